#include "diagnose/looked_at.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "diagnose/group_statistics.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// A set where it was linearised.
LookedAt placed(const Weighed& w, const std::vector<size_t>& effects) {
  const EffectSet& set = w.weighing.set_of(effects);
  LookedAt out;
  out.about = &w.weighing.about(effects);
  out.arm = arm_at(*out.about, set.chosen);
  out.scale = set.scale;
  out.posterior = posterior_of(w.study, w.evidence(), out.arm, set.scale);
  return out;
}

bool is_of(const Column& c, const std::vector<size_t>& effects) {
  return !c.is_base && !c.is_force && holds(effects, c.effect);
}

// The set's sizes with those effects of it at neutral that have no bit.
std::vector<Size> sizes_of_subset(const Arm& arm, size_t bits) {
  std::vector<size_t> lacking;
  for (size_t e = 0; e < arm.effects.size(); ++e)
    if (!(bits >> e & 1)) lacking.push_back(arm.effects[e]);
  std::vector<Size> out = arm.sizes;
  for (size_t k = 0; k < arm.columns.size(); ++k)
    if (is_of(arm.columns[k], lacking)) out[k] = Size::neutral;
  return out;
}

// Where subsets of a set's effects stand: where they were weighed. Those that lack an effect that the base was found
// with stand where the base alone was refitted without it: derivatives that were taken with it do not reach as far.
class Places {
 public:
  explicit Places(const Weighed& weighed) : weighed_(weighed), with_base_(found_with_base(weighed.study)) {}

  const Arm* of(const LookedAt& set, size_t bits) {
    std::vector<size_t> effects, lacking;
    for (size_t e = 0; e < set.arm.effects.size(); ++e) {
      const size_t effect = set.arm.effects[e];
      if (bits >> e & 1) effects.push_back(effect);
      else if (holds(with_base_, effect)) lacking.push_back(effect);
    }
    if (lacking.empty() && &weighed_.weighing.about(effects) == set.about) return &set.arm;
    const auto [place, is_new] = base_without_.try_emplace(lacking);
    if (is_new) place->second = base_without(lacking, set.scale);
    return place->second.residual.allFinite() ? &place->second : &set.arm;
  }

 private:
  Arm base_without(const std::vector<size_t>& lacking, size_t scale) const {
    Study& study = weighed_.study;
    const Linearisation& none = weighed_.weighing.none;
    Arm arm = arm_at(none, {});
    for (size_t k = 0; k < arm.columns.size(); ++k) {
      const Column& c = arm.columns[k];
      if (!is_of(c, lacking)) continue;
      arm.sizes[k] = Size::neutral;
      if (c.coordinate >= 0) arm.x(c.coordinate) = c.neutral;
    }
    if (!lacking.empty()) fit_arm(study, weighed_.windows, weighed_.evidence(), none, arm, scale);
    return arm;
  }

  const Weighed& weighed_;
  std::vector<size_t> with_base_;
  std::map<std::vector<size_t>, Arm> base_without_;  // by what they lack
};

// left: what its subsets leave, a bit an effect; first: the one that has none of them.
void fill_in(const Weighed& w, const Subset& first, const std::vector<HeldOut>& left, LookedAt& out) {
  Arm neutral = *first.arm;
  neutral.sizes = first.sizes;
  out.before = left.front();
  out.after = left.back();
  const VectorXd d = posterior_of(w.study, w.evidence(), neutral, out.scale).mean;
  out.without = {"none", neutral.branches, estimate_of(w.study, *out.about, neutral, d), out.before.coordinates};
  out.with = {name_of(w.study, out.arm.effects), out.arm.branches,
              estimate_of(w.study, *out.about, out.arm, out.posterior.mean), out.after.coordinates};
  if (!out.arm.effects.empty()) out.parts = shares_of(left, w.noise, w.study.groups.size(), out.unexplained);
}

}  // namespace

std::vector<LookedAt> look_at(const Weighed& w, const std::vector<std::vector<size_t>>& sets) {
  std::vector<LookedAt> out;
  for (const std::vector<size_t>& effects : sets) out.push_back(placed(w, effects));
  Places places(w);
  std::vector<Subset> subsets;
  for (const LookedAt& l : out)
    for (size_t bits = 0; bits < size_t{1} << l.arm.effects.size(); ++bits)
      subsets.push_back({places.of(l, bits), l.scale, sizes_of_subset(l.arm, bits)});
  const std::vector<HeldOut> left = hold_out(w.study, w.windows, w.evidence(), subsets);
  size_t next = 0;
  for (LookedAt& l : out) {
    const size_t end = next + (size_t{1} << l.arm.effects.size());
    const auto at = [&](size_t k) { return left.begin() + static_cast<std::ptrdiff_t>(k); };
    fill_in(w, subsets[next], {at(next), at(end)}, l);
    next = end;
  }
  return out;
}

double right_mm(const HeldOut& noise, const Protocol& protocol) {
  return std::hypot(noise.mm(), std::sqrt(noise.dimensions) * form_along_an_axis_mm(protocol));
}

double p_of_gap(const HeldOut& before, const HeldOut& noise, const Protocol& protocol) {
  const double right = right_mm(noise, protocol);
  std::vector<double> excess;
  for (Index g = 0; g < before.rows.size(); ++g)
    if (before.rows(g) > 0) excess.push_back(std::log(before.mm({static_cast<size_t>(g)}) / right));
  return p_above_zero(excess);
}

namespace {

// What a right model would take of the gap above the sensor's noise.
double right_takes(const HeldOut& before, const HeldOut& noise, const Protocol& protocol) {
  const auto square = [](double mm) { return mm * mm; };
  const double gap = square(before.mm()) - square(noise.mm());
  return gap > 0 ? std::max(0.0, square(before.mm()) - square(right_mm(noise, protocol))) / gap : 0;
}

}  // namespace

GapTaken taken_by(const LookedAt& l, const HeldOut& noise, const Protocol& protocol) {
  GapTaken out;
  const auto groups = static_cast<size_t>(l.before.rows.size());
  const double right = right_takes(l.before, noise, protocol), least = protocol.least_part * right;
  for (const Share& part : l.parts) {
    out.parts.push_back(part.value);
    out.takes.push_back(least_factor(p_so_low(part.value, part.high - part.value, groups, least)));
  }
  out.p_of_right = p_of_gap(l.after, noise, protocol);
  out.unexplained = std::max(0.0, l.unexplained.value - (1 - right));
  return out;
}

// Pooled over groups, before and after.
GapReduction reduction_of(const Study& study, const LookedAt& looked_at, const HeldOut& noise) {
  const HeldOut &before = looked_at.before, &after = looked_at.after;
  const auto fraction = [&](const std::vector<size_t>& groups) {
    const double gap = before.mm(groups) - noise.mm(groups);
    return gap > 1e-6 ? (before.mm(groups) - after.mm(groups)) / gap : 0;
  };
  const size_t groups = study.groups.size();
  const double all = fraction(all_groups(groups));
  // Trials to come vary as much as these: hence √2.
  const double half = std::sqrt(2.0) * half_interval(groups, fraction);
  return {before.mm(), after.mm(), all, all - half, all + half};
}

}  // namespace selvedge::diagnose
