#include "fit/tested_parameters.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace selvedge::fit {

namespace {

using material_tests::Joined;
using material_tests::KindAnswer;

// What the base lacks of this parameter: a shift of ln(value), and how far it may lie to either side.
struct Lacking {
  double shift = 0, sd = 0;
};

Lacking lacking_of(const std::string& name, const Joined& found, const std::vector<KindAnswer>& tests, double weight) {
  Lacking out;
  if (const auto a = joined(tests, name + "_anisotropy")) out.sd = 0.5 * std::abs(a->coordinate);
  const auto softening = joined(tests, "bend_stiffening");
  if (name == "bend" && softening) {
    const double curvature = std::cbrt(weight / std::exp(found.coordinate));
    out.shift = 0.5 * std::log(std::max(0.3, 1 + softening->coordinate * curvature * curvature));
    out.sd = std::hypot(out.sd, out.shift);
  }
  return out;
}

}  // namespace

TestedParameters tested_parameters(const trial::Campaign& campaign, model::Drag drag) {
  TestedParameters out{model::base_parameters(drag), {}, {}};
  const trial::Campaign tests = trial::only_tests(campaign, true);
  if (tests.trials.empty()) return out;
  out.tests = material_tests::fit_tests(tests);
  const trial::Trial& first = tests.trials.front();
  const double weight = trial::areal_mass(first) * first.gravity_m_s2.norm();
  for (model::Parameter& p : out.parameters) {
    const auto found = joined(out.tests, p.name);
    if (!found || !found->logarithmic) continue;
    const Lacking lacks = lacking_of(p.name, *found, out.tests, weight);
    p.start = std::clamp(std::exp(found->coordinate + lacks.shift), p.lower, p.upper);
    p.prior_sd = std::min(p.prior_sd, std::hypot(found->sd, lacks.sd));
    p.measured = true;
    p.tried.clear();
    out.remarks.push_back(fmt::format("{} begins at {:.3g} {} and is drawn to it, within a factor of {:.2f}: {} tests",
                                      p.name, p.start, p.unit, std::exp(1.645 * p.prior_sd), found->kinds));
  }
  for (const KindAnswer& of : out.tests)
    for (const std::string& remark : of.answer.remarks) out.remarks.push_back(of.kind + ": " + remark);
  return out;
}

void begin_like(const material_tests::LibraryFabric& fabric, TestedParameters& parameters) {
  constexpr double kAlike = 0.42;  // deviation of ln(value): nine in ten within a factor of two
  model::Parameter& bend = parameters.parameters[place_of(parameters.parameters, "bend")];
  if (bend.measured) return;
  bend.start = std::clamp(mean_bend(fabric), bend.lower, bend.upper);
  bend.prior_sd = kAlike;
  bend.measured = true;
  bend.tried.clear();
  parameters.remarks.push_back(
      fmt::format("bend begins at {:.3g} {} and is drawn to it, within a factor of two: that of {}", bend.start,
                  bend.unit, fabric.name));
}

}  // namespace selvedge::fit
