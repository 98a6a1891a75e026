#include "diagnose/told.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "diagnose/group_statistics.h"
#include "diagnose/looked_at.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Share of each effect's change that a refit of the base takes up, and of the residual that it explains beyond that.
void fill_screened(const Study& study, const Linearisation& about, std::vector<EffectFinding>& effects) {
  const BeyondBase beyond(about.changes.leftCols(static_cast<Index>(study.base_count)));
  const VectorXd left = beyond.of(about.residual);
  for (size_t e = 0; e < effects.size(); ++e) {
    std::vector<Index> columns;
    for (const Way& way : about.ways)
      if (way.effect == e) columns.insert(columns.end(), way.columns.begin(), way.columns.end());
    const MatrixXd all = about.changes(Eigen::all, columns), own = beyond.of(all);
    effects[e].absorbed = all.squaredNorm() > 0 ? 1 - own.squaredNorm() / all.squaredNorm() : 1;
    MatrixXd gram = own.transpose() * own;
    gram.diagonal().array() += 1e-9 * gram.trace() + 1e-30;
    const VectorXd with = own.transpose() * left;
    effects[e].screened_gain = std::clamp(with.dot(gram.ldlt().solve(with)) / left.squaredNorm(), 0.0, 1.0);
  }
}

}  // namespace

std::map<std::string, double> values_of(const Study& study, const VectorXd& x) {
  std::map<std::string, double> out;
  for (size_t k = 0; k < study.first_force; ++k)
    out[study.parameters[k].name] = model::to_value(study.parameters[k], x(static_cast<Index>(k)));
  return out;
}

std::vector<std::string> credible_set(const std::map<std::string, double>& probability, double credible) {
  std::vector<std::pair<double, std::string>> effects;
  double sum = 0;
  for (const auto& [name, p] : probability)
    if (name != "none" && name != "unknown") {
      effects.emplace_back(p, name);
      sum += p;
    }
  std::sort(effects.rbegin(), effects.rend());
  std::vector<std::string> set;
  double held = 0;
  for (const auto& [p, name] : effects) {
    if (held >= credible * sum) break;
    set.push_back(name);
    held += p;
  }
  return set;
}

void fill_gap(Diagnosis& out, const Study& study, const HeldOut& before, const HeldOut& noise) {
  out.is_ahead = before.dimensions == 3;
  out.before_mm = before.mm();
  out.noise_floor_mm = noise.mm();
  out.right_floor_mm = right_mm(noise, study.protocol);
  out.gap_mm = out.low_mm = out.high_mm = out.before_mm - out.noise_floor_mm;
  out.groups = study.groups.size();
  out.p_value = p_of_gap(before, noise, study.protocol);
  const double half = half_interval(
      study.groups.size(), [&](const std::vector<size_t>& groups) { return before.mm(groups) - noise.mm(groups); });
  out.low_mm -= half;
  out.high_mm += half;
}

void list_effects(Diagnosis& out, const Study& study, const Linearisation& about) {
  for (size_t e = 0; e < study.effects.size(); ++e) {
    EffectFinding& f = out.effects.emplace_back();
    f.name = study.effects[e].name;
    f.summary = study.effects[e].summary;
    f.side = study.effects[e].side;
    if (!about.can_tell[e]) out.cannot_tell.push_back(f.name);
  }
  fill_screened(study, about, out.effects);
}

void list_parameters(Diagnosis& out, const Study& study, const VectorXd& base, const VectorXd& likeliest) {
  for (size_t k = 0; k < study.base_count; ++k) {
    const model::Parameter& p = study.parameters[k];
    const double x = base(static_cast<Index>(k));
    out.parameters.push_back(
        {p.name, p.unit, model::to_value(p, x), model::to_value(p, likeliest(static_cast<Index>(k)))});
    if (x >= model::to_coordinate(p, p.upper) - 1e-3 || x <= model::to_coordinate(p, p.lower) + 1e-3)
      out.remarks.push_back(
          fmt::format("{} of the base model ends at its bound {:.3g} {}", p.name, model::to_value(p, x), p.unit));
  }
}

void list_measured(Diagnosis& out, const Measured& measured) {
  if (measured.held_m > 0)
    out.remarks.push_back(fmt::format(
        "markers on held points lie {:.1f} mm (root mean square) from the grips' path, which no physics lets "
        "them leave",
        1e3 * measured.held_m));
  out.remarks.insert(out.remarks.end(), measured.lost.begin(), measured.lost.end());
  if (measured.delay) out.remarks.push_back(in_words(*measured.delay));
}

}  // namespace selvedge::diagnose
