#include "evaluation/set_score.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace selvedge::evaluation {

namespace {

constexpr double kThere = 0.5;     // probability above which an effect is said to be there
constexpr double kQuarter = 0.25;  // of the gap

}  // namespace

bool AnsweredSet::is_named_right() const {
  if (outside) return named == "unknown";
  if (effects.empty()) return named == "none";
  if (true_share.empty() || effects.size() == 1) return effects.contains(named);
  const auto most = std::max_element(true_share.begin(), true_share.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  return named == most->first;
}

bool AnsweredSet::includes_all() const {
  return std::all_of(effects.begin(), effects.end(), [&](const std::string& effect) {
    const auto share = true_share.find(effect);
    if (share != true_share.end() && share->second < kQuarter) return true;
    const auto p = inclusion.find(effect);
    return p != inclusion.end() && p->second > kThere;
  });
}

bool AnsweredSet::includes_wrong() const {
  return std::any_of(inclusion.begin(), inclusion.end(),
                     [&](const auto& p) { return p.second > kThere && !effects.contains(p.first); });
}

std::pair<double, int> inclusion_error(const std::vector<AnsweredSet>& all, double from) {
  constexpr size_t kBins = 10;
  std::array<double, kBins> said{}, there{};
  int count = 0;
  for (const AnsweredSet& a : all)
    for (const auto& [effect, p] : a.inclusion) {
      if (p < from) continue;
      const auto bin = std::min(kBins - 1, static_cast<size_t>(std::max(0.0, p) * kBins));
      said[bin] += p;
      there[bin] += a.effects.contains(effect) ? 1 : 0;
      ++count;
    }
  double error = 0;
  for (size_t bin = 0; bin < kBins; ++bin) error += std::abs(said[bin] - there[bin]);
  return {count > 0 ? error / count : 0, count};
}

ShareScore score_shares(const std::vector<AnsweredSet>& all) {
  ShareScore out;
  for (const AnsweredSet& a : all)
    for (const auto& [effect, truly] : a.true_share) {
      const auto told = a.told.find(effect);
      if (told == a.told.end()) continue;
      out.errors.push_back(std::abs(told->second.share - truly));
      if (!(told->second.low <= told->second.high)) continue;
      ++out.of;
      out.held += truly >= told->second.low && truly <= told->second.high;
    }
  return out;
}

}  // namespace selvedge::evaluation
