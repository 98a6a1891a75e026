#include "material_tests/cantilever.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "files/bad_input.h"
#include "material_tests/small_fit.h"
#include "report/html.h"

namespace selvedge::material_tests {

using Eigen::Index;
using Eigen::Matrix2Xd;
using Eigen::Vector2d;
using Eigen::VectorXd;
using trial::Trial;

namespace {

constexpr double kSoftening_sd = 0.5;    // prior of B₂ / (B c): real fabrics lie between −0.7 and 0
constexpr double kInstrument_sd = 0.03;  // of ln(bending length): what one reading of the instrument repeats within
constexpr double kLeastNoise_m = 1e-7;
constexpr double kEdge_m = 1.5e-4, kTilt = 0.005;  // what a midline's edge and level are known to, deviations
constexpr double kScale = 0.007;  // and its lengths, relative: rendered photographs come back within 4 % of B

double weight_of(const Trial& t) { return trial::areal_mass(t) * t.gravity_m_s2.norm(); }

// 0 to 90°: a strip at −30° or 150° is the mirror image of one at 30°.
double mirrored(double angle_deg) {
  const double a = std::fmod(std::abs(angle_deg), 180.0);
  return a > 90 ? 180 - a : a;
}

struct Nearest {
  double distance = 0;  // positive below the line
  Vector2d normal;      // unit, downwards
};

// Behind the last point the distance is that from it.
Nearest nearest_on(const Matrix2Xd& line, const Vector2d& p) {
  double best = std::numeric_limits<double>::infinity();
  Nearest out;
  for (Index i = 0; i + 1 < line.cols(); ++i) {
    const Vector2d along = line.col(i + 1) - line.col(i), from = p - line.col(i);
    const double share = std::clamp(from.dot(along) / along.squaredNorm(), 0.0, 1.0);
    const Vector2d off = from - share * along;
    if (off.squaredNorm() >= best) continue;
    best = off.squaredNorm();
    const Vector2d across = Vector2d(-along.y(), along.x()).normalized();
    const double side = across.dot(off) < 0 ? -1 : 1;
    out.distance = side * off.norm();
    out.normal = off.norm() > 1e-12 ? Vector2d(side / off.norm() * off) : across;
  }
  return out;
}

// Distances of a midline from a strip, in units of noise_m, once the midline is moved and turned as its measurement may
// be off (kEdge_m, kTilt): what that takes comes last, in its own deviations.
VectorXd off_midline(const Matrix2Xd& midline, const Matrix2Xd& strip, double noise_m) {
  const Index n = midline.cols();
  VectorXd r(n);
  Eigen::MatrixX3d moves(n, 3);
  for (Index i = 0; i < n; ++i) {
    const Nearest at = nearest_on(strip, midline.col(i));
    r(i) = at.distance / noise_m;
    const Vector2d turned(-midline(1, i), midline(0, i));
    moves.row(i) << at.normal.x() * kEdge_m / noise_m, at.normal.y() * kEdge_m / noise_m,
        at.normal.dot(turned) * kTilt / noise_m;
  }
  const Eigen::Matrix3d normal = moves.transpose() * moves + Eigen::Matrix3d::Identity();
  const Eigen::Vector3d moved = normal.ldlt().solve(moves.transpose() * r);
  VectorXd out(n + 3);
  out << r - moves * moved, moved;
  return out;
}

BendingLaw law_at(const VectorXd& x) { return {std::exp(x(0)), std::exp(x(0)) * x(1)}; }

// Residuals of a strip: its midline's, and how it was moved; or its bending length's.
constexpr Index kMoves = 3;
Index rows_of(const Trial& t) {
  const Index points = t.cantilever->midline_m.cols();
  return points > 0 ? points + kMoves : 1;
}

// x: ln B, B₂ / B. The last residual is the prior's.
VectorXd residuals_of(const std::vector<const Trial*>& strips, const VectorXd& x, double noise_m) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const BendingLaw law = law_at(x);
  std::vector<double> r;
  for (const Trial* t : strips) {
    const trial::Cantilever& c = *t->cantilever;
    if (c.midline_m.cols() == 0) {
      const auto length = instrument_bending_length(law, weight_of(*t));
      r.push_back(length ? std::log(*length / *c.bending_length_m) / kInstrument_sd : nan);
      continue;
    }
    const auto strip = hanging_strip(law, weight_of(*t), c.overhang_m);
    VectorXd off = VectorXd::Constant(c.midline_m.cols() + kMoves, nan);
    if (strip) off = off_midline(c.midline_m, strip->point_m, noise_m);
    r.insert(r.end(), off.begin(), off.end());
  }
  r.push_back(x(1) / bending_length(law, weight_of(*strips.front())) / kSoftening_sd);
  return Eigen::Map<VectorXd>(r.data(), static_cast<Index>(r.size()));
}

size_t midline_points(const std::vector<const Trial*>& strips) {
  size_t n = 0;
  for (const Trial* t : strips) n += static_cast<size_t>(t->cantilever->midline_m.cols());
  return n;
}

// The best of bending lengths over a range of what a strip's shape can show, without softening.
double start_of(const std::vector<const Trial*>& strips, double noise_m) {
  double best = std::numeric_limits<double>::quiet_NaN(), least = std::numeric_limits<double>::infinity();
  const Trial& first = *strips.front();
  const double middle = first.cantilever->bending_length_m.value_or(0.6 * first.cantilever->overhang_m);
  for (double ratio = 0.15; ratio < 6; ratio *= 1.15) {
    const VectorXd x = Vector2d(std::log(weight_of(first) * std::pow(ratio * middle, 3)), 0);
    const VectorXd r = residuals_of(strips, x, noise_m);
    if (r.allFinite() && r.squaredNorm() < least) {
      least = r.squaredNorm();
      best = x(0);
    }
  }
  if (!std::isfinite(best))
    refuse(first.folder.string(), "found a line that no strip of {:.3g} m hanging over an edge takes, expected one",
           first.cantilever->overhang_m);
  return best;
}

// Neighbouring points of a midline err together, and one hand or threshold drew it all: how many of them count as one.
// No midline counts as more than kAlone points.
double points_as_one(const std::vector<const Trial*>& strips, const VectorXd& residuals) {
  constexpr double kAlone = 10;
  double together = 0, alone = 0, lines = 0;
  Index at = 0;
  for (const Trial* t : strips) {
    const Index n = t->cantilever->midline_m.cols();
    for (Index i = at; i + 1 < at + n; ++i) together += residuals(i) * residuals(i + 1);
    alone += residuals.segment(at, n).squaredNorm();
    at += rows_of(*t);
    if (n > 0) ++lines;
  }
  const double r = std::clamp(together / std::max(alone, 1e-300), 0.0, 0.98);
  return std::max((1 + r) / (1 - r), static_cast<double>(midline_points(strips)) / (kAlone * std::max(1.0, lines)));
}

struct Fitted {
  SmallFit fit;
  double noise_m = 0;
};

Fitted fit_law(const std::vector<const Trial*>& strips) {
  Fitted out{{}, 2e-4};
  const double c = std::cbrt(std::exp(start_of(strips, out.noise_m)) / weight_of(*strips.front()));
  VectorXd x = Vector2d(std::log(weight_of(*strips.front()) * c * c * c), 0);
  const Index points = static_cast<Index>(midline_points(strips));
  for (int round = 0; round < 4; ++round) {
    const auto residuals = [&](const VectorXd& scaled) {
      return residuals_of(strips, Vector2d(scaled(0), c * scaled(1)), out.noise_m);
    };
    out.fit = least_squares(residuals, Vector2d(x(0), x(1) / c), 1e-5, Vector2d(-40, -3), Vector2d(5, 3));
    x = Vector2d(out.fit.x(0), c * out.fit.x(1));
    if (points <= 2) break;
    // The noise is what is left; bending lengths keep their own.
    double sum = 0;
    Index at = 0;
    for (const Trial* t : strips) {
      const Index n = t->cantilever->midline_m.cols();
      sum += out.fit.residuals.segment(at, n).squaredNorm();
      at += rows_of(*t);
    }
    out.noise_m = std::max(kLeastNoise_m, out.noise_m * std::sqrt(sum / static_cast<double>(points - 2)));
  }
  out.fit.covariance *= points_as_one(strips, out.fit.residuals);
  out.fit.x = x;
  out.fit.covariance = Vector2d(1, c).asDiagonal() * out.fit.covariance * Vector2d(1, c).asDiagonal();
  return out;
}

// What strips cut from one fabric differ by, of ln B, over the root of their number: no interval is narrower.
double scatter_of_strips(const std::vector<const Trial*>& strips) {
  if (strips.size() < 3) return 0;
  std::vector<double> each;
  for (const Trial* t : strips) each.push_back(fit_law({t}).fit.x(0));
  double mean = 0, squares = 0;
  const double n = static_cast<double>(each.size());
  for (const double v : each) mean += v / n;
  for (const double v : each) squares += (v - mean) * (v - mean);
  return std::sqrt(squares / (n - 1) / n);
}

double share_of(double angle_deg, double anisotropy) {
  const double a = angle_deg * std::numbers::pi / 180, c = std::cos(a) * std::cos(a), s = std::sin(a) * std::sin(a);
  return std::exp(anisotropy) * c * c + 2 * c * s + std::exp(-anisotropy) * s * s;
}

std::string direction_name(double angle_deg) {
  return angle_deg == 0 ? "warp" : angle_deg == 90 ? "weft" : fmt::format("{:g}°", angle_deg);
}

void add_picture(Answer& answer, const std::vector<const Trial*>& strips, const DirectionBend& d) {
  std::vector<report::Series> series;
  for (const Trial* t : strips) {
    const auto strip = hanging_strip(d.law, weight_of(*t), t->cantilever->overhang_m);
    const auto add = [&](const std::string& name, const Matrix2Xd& line, bool points) {
      report::Series s{t->name + ", " + name, {}, {}, points};
      for (Index i = 0; i < line.cols(); ++i) {
        s.x.push_back(1e3 * line(0, i));
        s.y.push_back(-1e3 * line(1, i));
      }
      series.push_back(std::move(s));
    };
    if (t->cantilever->midline_m.cols() == 0 || series.size() >= 8) continue;
    add("measured", t->cantilever->midline_m, true);
    if (strip) add("simulated", strip->point_m, false);
  }
  if (series.empty()) return;
  report::PlotOptions plot;
  plot.x_label = "from the edge, mm";
  plot.y_label = "height, mm";
  answer.pictures.emplace_back(report::line_plot(series, plot),
                               fmt::format("strips along {}: {:.3f} mm root mean square from the simulated ones",
                                           direction_name(d.angle_deg), 1e3 * d.rms_m));
}

void report_direction(Answer& answer, const std::vector<const Trial*>& strips, const DirectionBend& d) {
  const double weight = weight_of(*strips.front()), sd = std::sqrt(d.covariance(0, 0));
  const std::string name = direction_name(d.angle_deg);
  answer.reported.push_back({"bend " + name, "N·m", d.law.bend, d.law.bend * sd});
  if (d.second_order_is_seen)
    answer.reported.push_back(
        {"second-order bend " + name, "N·m²", d.law.second_order, d.law.bend * std::sqrt(d.covariance(1, 1))});
  const double c = bending_length(d.law, weight);
  answer.reported.push_back({"bending length " + name, "mm", 1e3 * c, 1e3 * c * sd / 3});
  if (const auto length = instrument_bending_length(d.law, weight))
    answer.reported.push_back({"bending length by ISO 9073-7 " + name, "mm", 1e3 * *length, 1e3 * *length * sd / 3});
  for (const Trial* t : strips)
    if (t->cantilever->midline_m.cols() > 0)
      answer.errors.push_back(
          {t->name, "mm",
           1e3 * std::sqrt(residuals_of({t}, Vector2d(std::log(d.law.bend), d.law.second_order / d.law.bend), 1.0)
                               .head(t->cantilever->midline_m.cols())
                               .squaredNorm() /
                           static_cast<double>(t->cantilever->midline_m.cols())),
           0, static_cast<size_t>(t->cantilever->midline_m.cols())});
}

// bend and, with two directions or more, bend_anisotropy: weighted least squares of ln B over the directions.
void join_directions(Answer& answer, const std::vector<DirectionBend>& directions) {
  const bool several = directions.size() > 1;
  const Index count = several ? 2 : 1;
  const auto residuals = [&](const VectorXd& x) {
    VectorXd r(static_cast<Index>(directions.size()));
    for (size_t i = 0; i < directions.size(); ++i) {
      const DirectionBend& d = directions[i];
      const double law = x(0) + std::log(share_of(d.angle_deg, several ? x(1) : 0));
      r(static_cast<Index>(i)) = (std::log(d.law.bend) - law) / std::sqrt(d.covariance(0, 0));
    }
    return r;
  };
  VectorXd start = VectorXd::Zero(count);
  start(0) = std::log(directions.front().law.bend);
  const SmallFit fit =
      least_squares(residuals, start, 1e-5, VectorXd::Constant(count, -40), VectorXd::Constant(count, 5));
  answer.parameters.push_back({"bend", "N·m", std::exp(fit.x(0)), true});
  if (several) answer.parameters.push_back({"bend_anisotropy", "", fit.x(1), false});
  answer.covariance = fit.covariance;
  if (directions.size() > 2) answer.covariance *= std::max(1.0, fit.cost / static_cast<double>(directions.size() - 2));
  if (!several)
    answer.remarks.push_back(fmt::format("strips along {} alone: how bending differs between directions is not seen",
                                         direction_name(directions.front().angle_deg)));
}

// bend_stiffening: mean of the directions that show a second order, weighted.
void add_softening(Answer& answer, const std::vector<DirectionBend>& directions, double weight) {
  double sum = 0, weights = 0;
  for (const DirectionBend& d : directions) {
    if (!d.second_order_is_seen) continue;
    const double c = bending_length(d.law, weight), w = 1 / (d.covariance(1, 1) * c * c);  // of γ = c B₂ / B
    sum += w * bend_stiffening(d.law, weight);
    weights += w;
  }
  if (weights == 0) {
    answer.remarks.push_back(
        "how bending changes with curvature is not seen: that takes midlines of two overhangs or more");
    return;
  }
  const Index n = answer.covariance.rows();
  answer.parameters.push_back({"bend_stiffening", "m²", sum / weights, false});
  answer.covariance.conservativeResize(n + 1, n + 1);
  answer.covariance.row(n).setZero();
  answer.covariance.col(n).setZero();
  answer.covariance(n, n) = 1 / weights;
}

}  // namespace

DirectionBend fit_direction(const std::vector<const Trial*>& strips) {
  const Fitted fitted = fit_law(strips);
  DirectionBend out;
  out.angle_deg = mirrored(strips.front()->cantilever->angle_deg);
  out.law = law_at(fitted.fit.x);
  out.covariance = fitted.fit.covariance;
  out.covariance(0, 0) =
      std::max(out.covariance(0, 0), std::pow(scatter_of_strips(strips), 2)) + std::pow(3 * kScale, 2);
  const double c = bending_length(out.law, weight_of(*strips.front()));
  out.second_order_is_seen = midline_points(strips) > 0 && std::sqrt(out.covariance(1, 1)) < 0.3 * kSoftening_sd * c;
  out.rms_m = midline_points(strips) > 0 ? fitted.noise_m : 0;
  return out;
}

Answer fit_cantilever(const std::vector<const Trial*>& strips) {
  std::map<double, std::vector<const Trial*>> by_angle;
  for (const Trial* t : strips) by_angle[mirrored(t->cantilever->angle_deg)].push_back(t);
  Answer answer;
  std::vector<DirectionBend> directions;
  for (const auto& [angle, group] : by_angle) {
    directions.push_back(fit_direction(group));
    report_direction(answer, group, directions.back());
    add_picture(answer, group, directions.back());
  }
  join_directions(answer, directions);
  add_softening(answer, directions, weight_of(*strips.front()));
  return answer;
}

}  // namespace selvedge::material_tests
