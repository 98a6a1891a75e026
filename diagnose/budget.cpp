#include "diagnose/budget.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/parallel_for.h>

#include "diagnose/group_statistics.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

double dimensions_of(const Study& study) { return has_markers(study.simulation->trials()) ? 3 : 1; }

void add_squares(const Study& study, const Windows& windows, const Evidence& evidence, HeldOut& out) {
  const auto groups = static_cast<Index>(study.groups.size());
  out.square_mm2 = out.rows = VectorXd::Zero(groups);
  out.dimensions = dimensions_of(study);
  for (const Window& w : windows.windows()) {
    const double trust = evidence.trust(w, form_along_an_axis_mm(study.protocol));
    for (Index g = 0; g < groups; ++g)
      if (holds(study.groups[static_cast<size_t>(g)], w.trial)) {
        out.square_mm2(g) += trust * out.residual.segment(w.first, w.count).squaredNorm();
        out.rows(g) += trust * static_cast<double>(w.count);
      }
  }
}

// Of the squared gap: what a set of so many effects takes, a bit an effect.
using Taken = std::vector<HeldOut>;

double share_of(const Taken& taken, size_t effects, size_t which, const HeldOut& noise,
                const std::vector<size_t>& groups) {
  const auto square = [&](size_t set) {
    double sum = 0, rows = 0;
    for (const size_t g : groups) {
      sum += taken[set].square_mm2(static_cast<Index>(g)) - noise.square_mm2(static_cast<Index>(g));
      rows += taken[set].rows(static_cast<Index>(g));
    }
    return sum / std::max(rows, 1.0);
  };
  const double gap = square(0);
  if (!(gap > 0)) return 0;
  std::vector<size_t> order(effects);
  std::iota(order.begin(), order.end(), 0);
  double sum = 0, count = 0;
  do {
    size_t set = 0;
    for (const size_t e : order) {
      if (e == which) sum += square(set) - square(set | (size_t{1} << e));
      set |= size_t{1} << e;
    }
    ++count;
  } while (std::next_permutation(order.begin(), order.end()));
  return sum / count / gap;
}

Share with_interval(size_t groups, const std::function<double(const std::vector<size_t>&)>& figure) {
  const double value = figure(all_groups(groups)), half = half_interval(groups, figure);
  return {value, value - half, value + half};
}

}  // namespace

std::string percent(double share) { return fmt::format("{:.0f} %", 100 * share); }

std::string percent(const Share& s) {
  return std::isfinite(s.low) ? fmt::format("{} ({:.0f} … {:.0f})", percent(s.value), 100 * s.low, 100 * s.high)
                              : percent(s.value);
}

nlohmann::json to_json(const Share& s) {
  const auto number = [](double x) { return std::isfinite(x) ? nlohmann::json(x) : nlohmann::json(nullptr); };
  return {{"share", number(s.value)}, {"interval", {number(s.low), number(s.high)}}};
}

double HeldOut::mm(const std::vector<size_t>& groups) const {
  double sum = 0, count = 0;
  for (const size_t g : groups) {
    sum += square_mm2(static_cast<Index>(g));
    count += rows(static_cast<Index>(g));
  }
  return std::sqrt(dimensions * sum / std::max(count, 1.0));
}

double HeldOut::mm() const { return std::sqrt(dimensions * square_mm2.sum() / std::max(rows.sum(), 1.0)); }

namespace {

// What data say of an arm's columns: all trials but those of each group; of one group all.
std::vector<Gram> grams_of(const Study& study, const Evidence& evidence, const Arm& arm, size_t scale) {
  if (study.groups.size() == 1) return {evidence.gram(arm.changes, arm.residual, scale)};
  return evidence.grams_without(study.groups, arm.changes, arm.residual, scale);
}

using GramsOfArms = std::map<std::pair<const Arm*, size_t>, std::vector<Gram>>;  // by arm and scale

GramsOfArms grams_of(const Study& study, const Evidence& evidence, const std::vector<Subset>& subsets) {
  GramsOfArms out;
  for (const Subset& s : subsets)
    if (const std::pair key{s.arm, s.scale}; !out.contains(key))
      out.emplace(key, grams_of(study, evidence, *s.arm, s.scale));
  return out;
}

HeldOut hold_out(const Study& study, const Windows& windows, const Evidence& evidence, const Subset& subset,
                 const std::vector<Gram>& grams_without) {
  Arm arm = *subset.arm;
  arm.sizes = subset.sizes;
  HeldOut out;
  out.residual = arm.residual;
  out.coordinates.assign(study.groups.size(), arm.x);
  tbb::parallel_for(size_t{0}, study.groups.size(), [&](size_t g) {
    const VectorXd d = posterior_of(study, arm, grams_without[g], evidence.error().scales[subset.scale]).mean;
    out.coordinates[g] = moved(study, arm, d);
    for (const Window& w : windows.windows())
      if (holds(study.groups[g], w.trial))
        out.residual.segment(w.first, w.count) += arm.changes.middleRows(w.first, w.count) * d;
  });
  add_squares(study, windows, evidence, out);
  return out;
}

}  // namespace

std::vector<HeldOut> hold_out(const Study& study, const Windows& windows, const Evidence& evidence,
                              const std::vector<Subset>& subsets) {
  const GramsOfArms grams = grams_of(study, evidence, subsets);
  std::vector<HeldOut> out;
  for (const Subset& s : subsets) out.push_back(hold_out(study, windows, evidence, s, grams.at({s.arm, s.scale})));
  return out;
}

HeldOut left_by(const Study& study, const Windows& windows, const Evidence& evidence, VectorXd residual) {
  HeldOut out;
  out.residual = std::move(residual);
  add_squares(study, windows, evidence, out);
  return out;
}

HeldOut noise_of(const Study& study, const Windows& windows, const Evidence& evidence) {
  return left_by(study, windows, evidence, windows.noise_mm());
}

std::string cause_of(const std::map<std::string, double>& probability, const std::map<std::string, double>& inclusion,
                     const Budget& budget) {
  if (probability.at("unknown") > 0.5) return "unknown";
  const BudgetPart* most = nullptr;
  for (const BudgetPart& part : budget.parts)
    if (inclusion.at(part.effect) > 0.5 && (!most || part.share.value > most->share.value)) most = &part;
  if (most) return most->effect;
  return std::max_element(probability.begin(), probability.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

std::vector<Share> shares_of(const std::vector<HeldOut>& taken, const HeldOut& noise, size_t groups,
                             Share& unexplained) {
  size_t count = 0;
  while (size_t{1} << count < taken.size()) ++count;
  std::vector<Share> out;
  for (size_t e = 0; e < count; ++e)
    out.push_back(
        with_interval(groups, [&](const std::vector<size_t>& some) { return share_of(taken, count, e, noise, some); }));
  unexplained = with_interval(groups, [&](const std::vector<size_t>& some) {
    double explained = 0;
    for (size_t e = 0; e < count; ++e) explained += share_of(taken, count, e, noise, some);
    return 1 - explained;
  });
  return out;
}

}  // namespace selvedge::diagnose
