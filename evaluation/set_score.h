// How well answers say which effects are there, and what each takes of the gap.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace selvedge::evaluation {

// Inclusions below say that an effect is not there, and would swamp the others.
constexpr double kWorthSaying = 0.05;

struct ToldShare {
  double share = 0, low = 0, high = 0;  // 90 %; low above high: none told
};

// One campaign: what its key has, and what was answered.
struct AnsweredSet {
  std::set<std::string> effects;             // of the library, truly there
  bool outside = false;                      // something that the library has not
  std::map<std::string, double> true_share;  // of the gap, of each of `effects`; empty: not known
  std::string named;                         // first
  double probability = 0;                    // of that
  std::map<std::string, double> inclusion;
  std::map<std::string, ToldShare> told;  // of the budget

  // Whether the first name is right: of several effects the one that takes most, or where that is not known, any.
  bool is_named_right() const;
  // Whether every effect that takes a quarter of the gap or more is said to be there; all effects where shares are not
  // known.
  bool includes_all() const;
  bool includes_wrong() const;  // an effect that is not there is said to be
};

// Expected calibration error of inclusion over ten bins, of all effects of all campaigns whose probability is at least
// `from`; and how many they are.
std::pair<double, int> inclusion_error(const std::vector<AnsweredSet>& all, double from);

// Told and true shares of effects that are there and included: |told − true| of each, and how many intervals hold it.
struct ShareScore {
  std::vector<double> errors;
  int held = 0, of = 0;  // of intervals that were told
};
ShareScore score_shares(const std::vector<AnsweredSet>& all);

}  // namespace selvedge::evaluation
