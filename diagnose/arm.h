// A set of effects beside the base, where it is likeliest.
//
// Sets are weighed in closed form about one point (effect_sets.h). An arm is the likeliest of them, simulated at its
// own estimate and moved by damped steps until what was predicted and what is simulated agree. All coordinates move,
// what is negligible of the other effects too.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "diagnose/linearisation.h"

namespace selvedge::diagnose {

struct Arm {
  std::vector<size_t> effects;
  std::vector<Size> sizes;   // of each column of the linearisation
  Eigen::VectorXd x;         // all coordinates
  model::State branches;     // where its simulations begin
  Eigen::VectorXd residual;  // simulated there
  Eigen::VectorXd grid;      // what a finer grid adds
  std::vector<Column> columns;
  Eigen::MatrixXd changes;  // by columns, about x
};

// Whether a list of effects, or of trials, holds this one.
bool holds(const std::vector<size_t>& list, size_t x);

std::string name_of(const Study& study, const std::vector<size_t>& effects);

// Sizes of all columns where effects are there in these ways: free, the others negligible.
std::vector<Size> sizes_of(const Linearisation& about, const std::vector<const Way*>& chosen);

// An arm where the linearisation stands.
Arm arm_at(const Linearisation& about, const std::vector<const Way*>& chosen);

// All coordinates of an arm moved by d of its columns, within their bounds; the base no further than derivatives serve
// (Protocol::base_sd).
Eigen::VectorXd moved(const Study& study, const Arm& arm, const Eigen::VectorXd& d);

// The same of an arm about whose linearisation d was found; those of an effect that is there in the way of a start too.
Eigen::VectorXd estimate_of(const Study& study, const Linearisation& about, const Arm& arm, const Eigen::VectorXd& d);

// Its columns given the data, where it stands; gram: what data say of them at s.
Posterior posterior_of(const Study& study, const Evidence& evidence, const Arm& arm, size_t scale);
Posterior posterior_of(const Study& study, const Arm& arm, const Gram& gram, double s);

// Moves an arm from where `about` stands to where it is likeliest at this s, on the coarse grid, which stands in for
// the usual one with what that adds there. Derivatives by the base and by its own effects are taken again at each step:
// about a point that is not at the bottom sets of effects are no better than what they still have to go.
void approach(Study& study, const Windows& windows, const Evidence& evidence, const Linearisation& about, Arm& arm,
              size_t scale);

// Simulates an arm and moves it to where it is likeliest at this s.
void fit_arm(Study& study, const Windows& windows, const Evidence& evidence, const Linearisation& about, Arm& arm,
             size_t scale);

}  // namespace selvedge::diagnose
