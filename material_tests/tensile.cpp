#include "material_tests/tensile.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "report/html.h"

namespace selvedge::material_tests {

using Eigen::Index;
using Eigen::VectorXd;
using trial::Trial;

namespace {

constexpr double kNarrowing_sd = 0.5;   // of ln(narrowing seen one way over the other)
constexpr double kMostNarrowing = 1.5;  // its bound
constexpr double kPulls = 3;            // what a curve's points are worth together: one slack, one slope, one end
constexpr const char* kDirection[] = {"warp", "weft"};

bool has_direction(const std::vector<PullCurve>& curves, int direction) {
  return std::any_of(curves.begin(), curves.end(), [&](const PullCurve& c) { return c.direction == direction; });
}

StretchLaw law_at(const VectorXd& x, bool large) {
  StretchLaw law;
  law.stiffness = {std::exp(x(0)), std::exp(x(1))};
  law.coupling = x(2);
  law.stiffening = {x(3), x(large ? 4 : 3)};
  law.large = large;
  if (large) law.locking = {std::exp(x(5)), std::exp(x(6))};
  const double seen = x(x.size() - 1);
  law.narrowing_seen = {std::min(1.0, std::exp(-seen)), std::min(1.0, std::exp(seen))};
  return law;
}

// Where only one direction was pulled the other is taken to be as it is.
VectorXd with_one_direction(VectorXd x, int direction, bool large) {
  const Index other = 1 - direction;
  x(other) = x(direction);
  if (large) x(3 + other) = x(3 + direction);
  if (large) x(5 + other) = x(5 + direction);
  x(x.size() - 1) = 0;
  return x;
}

// Differences in stretch along and across, points compared, of all curves of a direction. visit(channel, difference).
template <class Visit>
void compare(const StretchLaw& law, const std::vector<PullCurve>& curves, int direction, double longest,
             const Visit& visit) {
  std::optional<Pulled> predicted;
  for (const PullCurve& c : curves) {
    if (c.direction != direction) continue;
    if (!predicted) predicted = pulled(law, direction, c.force);  // the same forces for all of a direction
    for (Index k = 0; k < c.force.size(); ++k) {
      if (!std::isfinite(c.along(k)) || c.along(k) > longest) continue;
      visit(c, size_t{0}, c.along(k) - predicted->along(k));
      if (std::isfinite(c.across(k))) visit(c, size_t{1}, c.across(k) - predicted->across(k));
    }
  }
}

VectorXd residuals_of(const StretchLaw& law, const std::vector<PullCurve>& curves, const Scatter& scatter,
                      double longest) {
  std::vector<double> r;
  for (int d = 0; d < 2; ++d)
    compare(law, curves, d, longest, [&](const PullCurve& c, size_t channel, double difference) {
      const double share = std::sqrt(kPulls / static_cast<double>(c.force.size()));
      r.push_back(share * difference / scatter[static_cast<size_t>(d)][channel]);
    });
  return Eigen::Map<VectorXd>(r.data(), static_cast<Index>(r.size()));
}

// The largest stretch of a direction, and the stiffness that a straight line to it would have.
struct Reach {
  double strain = 0.1, stiffness = 1;
};

Reach reach_of(const std::vector<PullCurve>& curves, int direction, double longest) {
  Reach reach{0, 1};
  for (const PullCurve& c : curves)
    for (Index k = 0; k < c.force.size(); ++k)
      if (c.direction == direction && c.along(k) - 1 > reach.strain && c.along(k) <= longest)
        reach = {c.along(k) - 1, c.force(k) / (c.along(k) - 1)};
  return reach;
}

// A pull towards where nothing says more.
VectorXd with_prior(VectorXd residuals, const VectorXd& x, const VectorXd& centre, bool large) {
  const Index n = residuals.size();
  VectorXd sd = VectorXd::Constant(x.size(), 3);
  sd(2) = 0.5;
  sd(3) = 20;
  if (large) sd(4) = 20;
  sd(x.size() - 1) = kNarrowing_sd;
  residuals.conservativeResize(n + x.size());
  residuals.tail(x.size()) = (x - centre).cwiseQuotient(sd);
  return residuals;
}

std::vector<double> unit_in_newton(const std::string& unit) {
  static const std::map<std::string, double> known = {{"N", 1},           {"mN", 1e-3},     {"cN", 1e-2},
                                                      {"gf", 9.80665e-3}, {"kgf", 9.80665}, {"lbf", 4.4482216}};
  const auto at = known.find(unit);
  return at == known.end() ? std::vector<double>{} : std::vector<double>{at->second};
}

// How far up the sheet's law holds: the longest of a few stretches to which it lies within the pulls' scatter.
StretchFit sheet_law(const std::vector<PullCurve>& curves, const Scatter& scatter) {
  constexpr double kWithin = 1.5;  // times the scatter
  constexpr size_t kFewest = 4;    // points a curve, on average
  StretchFit best;
  for (const double longest : {1.03, 1.05, 1.08, 1.12, 1.2, 1.3, 1.5, 2.0, 5.0}) {
    size_t compared = 0;
    for (const PullCurve& c : curves) compared += static_cast<size_t>((c.along <= longest).count());
    if (compared < kFewest * curves.size()) continue;
    const StretchFit fit = fit_stretch_law(curves, scatter, false, longest);
    bool holds = true;
    for (size_t d = 0; d < 2; ++d)
      for (size_t channel = 0; channel < 2; ++channel)
        holds = holds && !(fit.rms[d][channel] > kWithin * scatter[d][channel]);
    if (holds || best.longest == 0) best = fit;
    if (!holds) break;
  }
  return best;
}

// only: the direction that was pulled, −1 where both were. scaled: force is in newton.
void add_parameters(Answer& answer, const StretchFit& sheet, int only, bool scaled) {
  const SmallFit& fit = sheet.fit;
  // ln k_u, ln k_v, ν, β to ln stretch, a, ν, β.
  Eigen::Matrix4d to = Eigen::Matrix4d::Identity();
  if (only < 0) to.topLeftCorner<2, 2>() << 0.5, 0.5, 0.5, -0.5;
  if (only == 1) to.topLeftCorner<2, 2>() << 0, 1, 1, 0;
  const Eigen::Vector4d x = to * fit.x.head<4>();
  const double worse = std::max(1.0, fit.cost / std::max(1.0, static_cast<double>(fit.residuals.size()) - 8));
  const Eigen::Matrix4d all = worse * to * fit.covariance.topLeftCorner<4, 4>() * to.transpose();
  const Determined rows[] = {{"stretch", "N/m", std::exp(x(0)), true},
                             {"stretch_anisotropy", "", x(1), false},
                             {"coupling", "", x(2), false},
                             {"stretch_stiffening", "", x(3), false}};
  std::vector<Index> kept;
  for (Index k = 0; k < 4; ++k)
    if ((only < 0 || k != 1) && (scaled || k != 0)) kept.push_back(k);
  for (const Index k : kept) answer.parameters.push_back(rows[k]);
  answer.covariance = all(kept, kept);
}

void add_picture(Answer& answer, const std::vector<PullCurve>& curves, const StretchFit& sheet, const StretchFit& large,
                 int direction, const std::string& unit) {
  std::vector<report::Series> series;
  const auto add = [&](const std::string& name, const Eigen::ArrayXd& x, const Eigen::ArrayXd& y, bool points) {
    series.push_back({name, {x.data(), x.data() + x.size()}, {y.data(), y.data() + y.size()}, points});
  };
  const PullCurve* one = nullptr;
  for (const PullCurve& c : curves) {
    if (c.direction != direction) continue;
    one = &c;
    add(fmt::format("pull {}", c.number), c.along, c.force, true);
  }
  if (one == nullptr) return;
  const Pulled far = pulled(large.law, direction, one->force);
  add("law of large strain", far.along, one->force, false);
  Eigen::ArrayXd near = pulled(sheet.law, direction, one->force).along;
  for (double& s : near)
    if (s > sheet.longest) s = std::nan("");
  add("the sheet's law, as far as it holds", near, one->force, false);
  report::PlotOptions plot;
  plot.x_label = "stretch along";
  plot.y_label = fmt::format("force per width, {}/m", unit);
  answer.pictures.emplace_back(report::line_plot(series, plot),
                               fmt::format("pulled along the {}", kDirection[direction]));
  series.clear();
  for (const PullCurve& c : curves)
    if (c.direction == direction) add(fmt::format("pull {}", c.number), c.along, c.across, true);
  add("law of large strain", far.along, far.across, false);
  plot.y_label = "stretch across";
  answer.pictures.emplace_back(report::line_plot(series, plot),
                               fmt::format("narrowing, pulled along the {}", kDirection[direction]));
}

// What a reader should know of the pulls: how far the laws hold, losses.
void add_findings(Answer& answer, const std::vector<PullCurve>& curves, const Scatter& scatter, const StretchFit& sheet,
                  const StretchFit& large) {
  double reached = 1;
  for (const PullCurve& c : curves)
    for (const double s : c.along)
      if (s > reached) reached = s;
  answer.reported.push_back({"stretch up to which the sheet's law holds", "", std::min(sheet.longest, reached), 0});
  for (int d = 0; d < 2; ++d) {
    if (!has_direction(curves, d)) continue;
    const auto at = static_cast<size_t>(d);
    if (large.law.locking[at] < 50)
      answer.reported.push_back({fmt::format("locking strain {}", kDirection[d]), "", large.law.locking[at], 0});
    if (large.law.narrowing_seen[at] < 0.9)
      answer.reported.push_back({fmt::format("share of the narrowing that is seen, pulled along the {}", kDirection[d]),
                                 "", large.law.narrowing_seen[at], 0});
    if (large.law.narrowing_seen[at] < 1.01 * std::exp(-kMostNarrowing))
      answer.remarks.push_back(fmt::format(
          "the share of the narrowing that is seen, pulled along the {}, ends at its bound: no law with one "
          "coupling for both directions holds",
          kDirection[d]));
    size_t samples = 0;
    for (const PullCurve& c : curves)
      if (c.direction == d) samples += static_cast<size_t>(c.force.size());
    for (size_t channel = 0; channel < 2; ++channel) {
      const char* name = channel == 0 ? "along" : "across";
      answer.errors.push_back({fmt::format("{}, stretch {}", kDirection[d], name), "", large.rms[at][channel],
                               scatter[at][channel], samples});
      if (large.rms[at][channel] > 2 * scatter[at][channel])
        answer.remarks.push_back(fmt::format(
            "pulled along the {}, no orthotropic law here holds: stretch {} is {:.3f} off, pulls scatter by {:.3f}",
            kDirection[d], name, large.rms[at][channel], scatter[at][channel]));
    }
  }
  std::vector<double> losses;
  for (const PullCurve& c : curves)
    if (c.loss) losses.push_back(*c.loss);
  if (losses.empty()) {
    answer.remarks.push_back("no pull comes back to a fifth of its force: hysteresis is not seen");
    return;
  }
  double mean = 0, squares = 0;
  for (const double l : losses) mean += l / static_cast<double>(losses.size());
  for (const double l : losses) squares += (l - mean) * (l - mean);
  answer.reported.push_back(
      {"work lost in a cycle", "", mean, std::sqrt(squares / std::max(1.0, static_cast<double>(losses.size()) - 1))});
}

}  // namespace

std::array<double, 2> misfit(const StretchLaw& law, const std::vector<PullCurve>& curves, int direction,
                             double longest) {
  std::array<double, 2> sum{}, count{};
  compare(law, curves, direction, longest, [&](const PullCurve&, size_t channel, double difference) {
    sum[channel] += difference * difference;
    ++count[channel];
  });
  for (size_t channel = 0; channel < 2; ++channel)
    sum[channel] = count[channel] > 0 ? std::sqrt(sum[channel] / count[channel]) : 0;
  return sum;
}

StretchFit fit_stretch_law(const std::vector<PullCurve>& curves, const Scatter& scatter, bool large, double longest) {
  const bool both = has_direction(curves, 0) && has_direction(curves, 1);
  const int only = has_direction(curves, 0) ? 0 : 1;
  const Index n = large ? 8 : 5;
  VectorXd low(n), high(n), centre(n);
  const Reach u = reach_of(curves, both ? 0 : only, longest), v = reach_of(curves, both ? 1 : only, longest);
  centre.head(4) << std::log(u.stiffness), std::log(v.stiffness), 0.3, 0;
  low.head(4) << -25, -25, -0.3, -20;
  high.head(4) << 25, 25, 0.95, 200;
  centre(n - 1) = 0;
  low(n - 1) = -kMostNarrowing;
  high(n - 1) = kMostNarrowing;
  const auto strain = [](double e) { return std::log(e + 0.5 * e * e); };
  if (large) {
    centre.segment(4, 3) << 0, strain(u.strain), strain(v.strain);
    low.segment(4, 3) << -20, -4, -4;
    high.segment(4, 3) << 200, 6, 6;
  }
  StretchFit best;
  best.fit.cost = std::numeric_limits<double>::infinity();
  const auto at = [&](const VectorXd& x) { return law_at(both ? x : with_one_direction(x, only, large), large); };
  const auto fit_from = [&](const VectorXd& start) {
    SmallFit fit = least_squares(
        [&](const VectorXd& x) { return with_prior(residuals_of(at(x), curves, scatter, longest), x, centre, large); },
        start, 1e-4, low, high);
    if (fit.cost < best.fit.cost) best.fit = std::move(fit);
  };
  // The search ends in different places: from softer and stiffer, earlier and later locking, knits that give way after
  // a stiff beginning; and once more from about the best.
  for (const double stiffer : {-0.7, 0.7})
    for (const double later : large ? std::vector<double>{-0.3, 0.1, 0.5} : std::vector<double>{0})
      for (const double softening : {0.0, 1.0, 4.0}) {
        VectorXd start = centre;
        start.head(2).array() += stiffer;
        start.segment(3, large ? 2 : 1).setConstant(-softening);
        if (large) start.segment(5, 2).array() += later;
        fit_from(start);
      }
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 0.15);
  for (int again = 0; again < (large ? 16 : 4); ++again)
    fit_from(best.fit.x + VectorXd(best.fit.x.cwiseAbs().cwiseMax(1).array() *
                                   VectorXd::NullaryExpr(n, [&] { return normal(random); }).array()));
  best.law = at(best.fit.x);
  best.longest = longest;
  for (int d = 0; d < 2; ++d) best.rms[static_cast<size_t>(d)] = misfit(best.law, curves, d, longest);
  return best;
}

Answer fit_tensile(const std::vector<const Trial*>& strips) {
  const std::string unit = strips.front()->tensile->force_unit;
  for (const Trial* t : strips)
    if (t->tensile->force_unit != unit)
      refuse((t->folder / "trial.json").string(), "found force_unit {}, expected {} as in {}",
             in_quotes(t->tensile->force_unit), in_quotes(unit), strips.front()->name);
  std::vector<PullCurve> curves = pull_curves(strips);
  if (curves.empty())
    refuse(strips.front()->folder.string(), "found no pull along the warp or the weft, expected angle_deg 0 or 90");
  const std::vector<double> newton = unit_in_newton(unit);
  for (PullCurve& c : curves)
    if (!newton.empty()) c.force *= newton.front();
  const Scatter scatter = scatter_of(curves);
  const int only = !has_direction(curves, 1) ? 0 : !has_direction(curves, 0) ? 1 : -1;
  const StretchFit sheet = sheet_law(curves, scatter), large = fit_stretch_law(curves, scatter, true);
  Answer answer;
  const std::string shown = newton.empty() ? unit : "N";
  add_parameters(answer, sheet, only, !newton.empty());
  if (newton.empty())
    answer.remarks.push_back(fmt::format(
        "force was recorded in {}, which is no unit of force known here: stretch in N/m is not determined, its "
        "anisotropy, coupling and stiffening are",
        in_quotes(unit)));
  if (only >= 0)
    answer.remarks.push_back(
        fmt::format("pulled along the {} alone: the other direction is taken to be as it is", kDirection[only]));
  for (int d = 0; d < 2; ++d) {
    if (newton.empty() && has_direction(curves, d))
      answer.reported.push_back(
          {fmt::format("stretch {}", kDirection[d]), unit + "/m", sheet.law.stiffness[static_cast<size_t>(d)], 0});
    add_picture(answer, curves, sheet, large, d, shown);
  }
  add_findings(answer, curves, scatter, sheet, large);
  return answer;
}

}  // namespace selvedge::material_tests
