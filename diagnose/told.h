// What a diagnosis says of its parts: parameters, gap, effects, what was measured.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "diagnose/diagnosis_result.h"

namespace selvedge::diagnose {

// In their units, but for the smooth forces.
std::map<std::string, double> values_of(const Study& study, const Eigen::VectorXd& coordinates);

// The smallest set of effects that holds `credible` of what the effects have together.
std::vector<std::string> credible_set(const std::map<std::string, double>& probability, double credible);

// Of the base, held out, beyond the sensor's noise.
void fill_gap(Diagnosis& out, const Study& study, const HeldOut& before, const HeldOut& noise);

void list_effects(Diagnosis& out, const Study& study, const Linearisation& about);

// base, likeliest: all coordinates, without and with the likeliest set.
void list_parameters(Diagnosis& out, const Study& study, const Eigen::VectorXd& base, const Eigen::VectorXd& likeliest);

void list_measured(Diagnosis& out, const Measured& measured);

}  // namespace selvedge::diagnose
