#include "diagnose/sizes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnose/arm.h"
#include "diagnose/linearisation.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kNinety = 1.6448536269514722;  // standard deviations on either side hold 90 % of a normal variable

double size_share(const Protocol& protocol, Side side) {
  const bool of_rig = side == Side::measurement || side == Side::boundary || side == Side::aerodynamic;
  return of_rig ? protocol.rig_size_share : protocol.fabric_size_share;
}

// Of an effect's parameter, in its unit: what no set tells from nothing.
double negligible_size(const Linearisation& about, const Way& way, size_t k, const model::Parameter& p) {
  const auto deviation = [&](size_t i, double unit) {
    return std::abs(model::to_value(p, unit * about.columns[static_cast<size_t>(way.columns[i])].negligible_sd));
  };
  if (way.units.empty()) return deviation(k, 1);
  double most = 0;
  for (size_t i = 0; i < way.units.size(); ++i) most = std::max(most, deviation(i, way.units[i](0) - neutral_of(p)));
  return most;
}

}  // namespace

std::vector<SizedParameter> size_of(const Study& study, const Linearisation& about, const std::vector<Size>& sizes,
                                    const VectorXd& x, const Posterior& posterior, size_t effect) {
  const Effect& e = study.effects[effect];
  const double form_share = kNinety * size_share(study.protocol, e.side);
  std::vector<SizedParameter> out;
  const auto add = [&](const model::Parameter& p, double coordinate, double deviation) {
    const double value = model::to_value(p, coordinate),
                 half = std::hypot(kNinety * std::abs(model::to_value(p, deviation)), form_share * std::abs(value));
    out.push_back({p.name, p.unit, value, std::max(p.lower, value - half), std::min(p.upper, value + half)});
  };
  for (const Way& way : about.ways) {
    if (way.effect != effect || sizes[static_cast<size_t>(way.columns[0])] != Size::free) continue;
    if (!way.units.empty()) {
      const VectorXd at = effect_at(study, way, posterior.mean);
      add(e.parameters[0], at(0), deviation_at(study, way, posterior));
      for (Index j = 1; j < at.size(); ++j) add(e.parameters[static_cast<size_t>(j)], at(j), 0);
      continue;
    }
    for (const Index k : way.columns) {
      const Column& c = about.columns[static_cast<size_t>(k)];
      add(study.parameters[static_cast<size_t>(c.coordinate)],
          std::clamp(x(c.coordinate) + posterior.mean(k), c.lower, c.upper), posterior.sd(k));
    }
  }
  return out;
}

std::vector<std::vector<SizedParameter>> sizes_at_most(const Study& study, const Evidence& evidence,
                                                       const Linearisation& about,
                                                       const std::vector<const Way*>& beside, size_t scale) {
  const Gram gram = evidence.gram(about.changes, about.residual, scale);
  std::vector<std::vector<SizedParameter>> out(study.effects.size());
  std::vector<double> most(out.size(), -std::numeric_limits<double>::infinity());
  for (const Way& way : about.ways) {
    const auto is_same = [&](const Way* other) { return other->effect == way.effect; };
    if (!about.can_tell[way.effect] || std::any_of(beside.begin(), beside.end(), is_same)) continue;
    std::vector<const Way*> with = beside;
    with.push_back(&way);
    const std::vector<Size> sizes = sizes_of(about, with);
    std::vector<Prior> priors = priors_of(study, about.columns, about.x, sizes, evidence.error().scales[scale]);
    const Posterior likeliest = posterior(gram, priors);
    if (likeliest.log_evidence <= most[way.effect]) continue;
    most[way.effect] = likeliest.log_evidence;
    // What is held at a bound there could move.
    for (const Index k : way.columns) {
      Prior& own = priors[static_cast<size_t>(k)];
      own = {own.mean, own.sd};
    }
    Posterior given = posterior(gram, priors);
    given.mean = likeliest.mean;
    std::vector<SizedParameter>& found = out[way.effect];
    found = size_of(study, about, sizes, about.x, given, way.effect);
    if (!way.units.empty()) found.resize(1);
    for (size_t k = 0; k < found.size(); ++k) {
      const model::Parameter& p = study.effects[way.effect].parameters[k];
      const double least = kNinety * negligible_size(about, way, k, p);
      found[k].low = std::min(found[k].low, std::max(p.lower, p.start - least));
      found[k].high = std::max(found[k].high, std::min(p.upper, p.start + least));
    }
  }
  return out;
}

}  // namespace selvedge::diagnose
