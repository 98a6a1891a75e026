#include "diagnose/sizes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <boost/math/distributions/normal.hpp>

#include "diagnose/arm.h"
#include "diagnose/linearisation.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

double size_share(const Protocol& protocol, Side side) {
  const bool of_rig = side == Side::measurement || side == Side::boundary || side == Side::aerodynamic;
  return of_rig ? protocol.rig_size_share : protocol.fabric_size_share;
}

}  // namespace

std::vector<SizedParameter> size_of(const Study& study, const Linearisation& about, const std::vector<Size>& sizes,
                                    const VectorXd& x, const Posterior& posterior, size_t effect) {
  const double k90 = boost::math::quantile(boost::math::normal(), 0.95);
  const Effect& e = study.effects[effect];
  const double form_share = k90 * size_share(study.protocol, e.side);
  std::vector<SizedParameter> out;
  const auto add = [&](const model::Parameter& p, double coordinate, double deviation) {
    const double value = model::to_value(p, coordinate),
                 half = std::hypot(k90 * std::abs(model::to_value(p, deviation)), form_share * std::abs(value));
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
    std::vector<Prior> priors;
    for (size_t k = 0; k < about.columns.size(); ++k)
      priors.push_back(prior_of(study, about.columns[k], about.x, sizes[k], evidence.error().scales[scale]));
    const Posterior given = posterior(gram, priors);
    if (given.log_evidence <= most[way.effect]) continue;
    most[way.effect] = given.log_evidence;
    std::vector<SizedParameter>& found = out[way.effect];
    found = size_of(study, about, sizes, about.x, given, way.effect);
    if (!way.units.empty()) found.resize(1);
    for (size_t k = 0; k < found.size(); ++k) {
      const double neutral = study.effects[way.effect].parameters[k].start;
      found[k].low = std::min(found[k].low, neutral);
      found[k].high = std::max(found[k].high, neutral);
    }
  }
  return out;
}

}  // namespace selvedge::diagnose
