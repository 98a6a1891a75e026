// The missing force: where on the fabric, when and in which direction a model lacks force, N/m², as the windows have
// it.
//
// In each window the smooth forces that would take away what the model leaves, given the sensor's noise and their usual
// size times s (evidence.h): their mean and standard deviation on a grid of the fabric, fixed in the room.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include "diagnose/arm.h"

namespace selvedge::diagnose {

struct MissingForce {
  struct Window {
    std::string trial;
    double from_s = 0, to_s = 0;
    Eigen::Matrix3Xd mean_n_m2, sd_n_m2;  // one column a place
  };
  std::vector<Eigen::Vector2d> uv_m;  // the places
  std::vector<Window> windows;
};

// Of what an arm leaves at its own estimate.
MissingForce missing_force(const Study& study, const Windows& windows, const Evidence& evidence, const Arm& arm,
                           size_t scale);

// "missing_force/1": {"grid_uv_m": [[u, v], …], "windows": [{"trial", "from_s", "to_s", "mean_n_m2": [[x, y, z], …],
// "sd_n_m2": […]}, …]}.
nlohmann::json to_json(const MissingForce& force);

}  // namespace selvedge::diagnose
