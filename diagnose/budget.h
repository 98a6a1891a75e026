// The budget of a gap: of what the base leaves in trials that it was not fitted to, above the sensor's noise, how much
// each effect takes, and how much nothing explains.
//
// A set's effects are taken away in every order; an effect's part is the mean over orders of how much more is left
// without it (Shapley 1953), so that parts add up whatever effects overlap. Every figure is of trials that were held
// out: an arm's coordinates are found again without each group of trials, in closed form where the arm stands.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "diagnose/arm.h"

namespace selvedge::diagnose {

// What an arm leaves of each group of trials that its coordinates were found without. Windows count by
// Evidence::trust.
struct HeldOut {
  Eigen::VectorXd square_mm2, rows;          // a group: sum of squares, and of how many rows
  std::vector<Eigen::VectorXd> coordinates;  // a group: all coordinates, found without it
  Eigen::VectorXd residual;                  // mm, all rows, each predicted without its group
  // Root mean square over some groups: distance of a marker in space, or of a point of pictures.
  double mm(const std::vector<size_t>& groups) const;
  double mm() const;
  double dimensions = 3;
};

// Some effects, in closed form about an arm that need not have them; at this s.
struct Subset {
  const Arm* arm = nullptr;
  size_t scale = 0;
  std::vector<Size> sizes;  // of each column
};

// What each leaves.
std::vector<HeldOut> hold_out(const Study& study, const Windows& windows, const Evidence& evidence,
                              const std::vector<Subset>& subsets);

// What the sensor alone leaves of each group.
HeldOut noise_of(const Study& study, const Windows& windows, const Evidence& evidence);

struct Share {
  double value = 0, low = 0, high = 0;  // of the squared gap; 90 %, jackknife over groups of trials
};

std::string percent(double share);        // "79 %"
std::string percent(const Share& share);  // "79 % (67 … 91)"
// {"share", "interval"}; null for what is not finite.
nlohmann::json to_json(const Share& share);

struct BudgetPart {
  std::string effect;
  double probability = 0;  // that it is there
  Share share;
};

struct Budget {
  double total_mm = 0, noise_mm = 0;  // what the base leaves, and the sensor
  std::vector<BudgetPart> parts;      // of the likeliest set
  Share unexplained;
};

// Unknown where that is likelier than not; else the effect that takes most of the budget among those that are likelier
// there than not; where there is none, the likeliest of none, unknown and every effect.
std::string cause_of(const std::map<std::string, double>& probability, const std::map<std::string, double>& inclusion,
                     const Budget& budget);

// What rows are left by something, mm, of each group of trials.
HeldOut left_by(const Study& study, const Windows& windows, const Evidence& evidence, Eigen::VectorXd residual);

// What is left by each set of some parts, a bit a part: the share that each part takes of the gap above noise.
std::vector<Share> shares_of(const std::vector<HeldOut>& left_by_sets, const HeldOut& noise, size_t groups,
                             Share& unexplained);

}  // namespace selvedge::diagnose
