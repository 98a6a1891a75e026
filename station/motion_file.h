// The motion that a fit's parameters give each trial, kept beside the fit so that others can show it without simulating
// again: FOLDER/simulated/TRIAL.json and TRIAL.f32.
//
// TRIAL.json: {"format": "motion/1", "trial", "uv_m": [[u, v], …], "triangles": [[a, b, c], …], "time_s": […]};
// TRIAL.f32: x, y, z of each vertex at each time, little-endian 32-bit floats, m, motion-capture frame.
// Times are the trial's own: those of its frames, or of its markers' samples.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace selvedge::station {

struct SimulatedMotion {
  std::vector<Eigen::Vector2d> uv_m;  // of each vertex on the flat fabric
  std::vector<std::array<int, 3>> triangles;
  std::vector<double> time_s;
  std::vector<Eigen::Matrix3Xf> position;  // one a time
};

std::filesystem::path motion_path(const std::filesystem::path& folder, const std::string& trial);
// Throws BadInput where there is none or it is no good.
SimulatedMotion read_simulated_motion(const std::filesystem::path& folder, const std::string& trial);

}  // namespace selvedge::station
