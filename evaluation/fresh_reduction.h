// How far an effect takes the error of trials that no answer was fitted to: what a diagnosis' gap reduction is judged
// by.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "capture/trial/trial.h"
#include "diagnose/effects/effect.h"

namespace selvedge::evaluation {

struct FreshReduction {
  double before_mm = 0, after_mm = 0, noise_mm = 0;  // root mean square over all markers of all trials
  double fraction() const { return (before_mm - after_mm) / (before_mm - noise_mm); }
};

// Predicts trials of markers with both sets of diagnosis.json's `fit`, "none" and `hypothesis`, on a grid of `cells`, a
// quarter of a second ahead (windows.h). Throws nlohmann::json::out_of_range where it has no such set.
FreshReduction reduction_on(const trial::Campaign& fresh, const std::vector<diagnose::Effect>& effects,
                            const nlohmann::json& diagnosis, const std::string& hypothesis, int cells = 24);

}  // namespace selvedge::evaluation
