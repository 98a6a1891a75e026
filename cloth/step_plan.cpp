#include "cloth/step_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include <Eigen/Core>

namespace selvedge::cloth {

namespace {

using Vector = Eigen::VectorXd;

// Largest eigenvalue of M⁻¹K by power iteration; apply: y = K x, per_vertex numbers a vertex.
double largest_eigenvalue(const std::vector<double>& inverse_mass, size_t per_vertex,
                          const std::function<void(const Vector&, Vector&)>& apply) {
  const size_t size = per_vertex * inverse_mass.size();
  Vector x(static_cast<Eigen::Index>(size)), y(static_cast<Eigen::Index>(size));
  for (size_t i = 0; i < size; ++i)  // a rough start that holds every mode
    x(static_cast<Eigen::Index>(i)) = std::sin(12.9898 * static_cast<double>(i + 1)) + (i % 2 ? 0.5 : -0.5);
  double value = 0;
  for (int k = 0; k < 40; ++k) {
    x.normalize();
    apply(x, y);
    for (size_t i = 0; i < size; ++i) y(static_cast<Eigen::Index>(i)) *= inverse_mass[i / per_vertex];
    value = y.norm();
    x = y;
  }
  return 1.05 * value;  // forty iterations come within a few percent from below
}

// y += factor Q x on every per_vertex-th number.
void add_bending(const kernel::SheetData& s, double factor, Eigen::Index per_vertex, const Vector& x, Vector& y) {
  for (int i = 0; i < s.vertex_count; ++i)
    for (int k = s.bend_matrix.start[static_cast<size_t>(i)]; k < s.bend_matrix.start[static_cast<size_t>(i) + 1]; ++k)
      for (Eigen::Index c = 0; c < per_vertex; ++c)
        y(per_vertex * i + c) += factor * s.bend_matrix.value[static_cast<size_t>(k)] *
                                 x(per_vertex * s.bend_matrix.index[static_cast<size_t>(k)] + c);
}

struct InPlane {
  double ku, kv, coupling, shear, bend;
};

double in_plane_eigenvalue(const kernel::SheetData& s, const std::vector<double>& inverse_mass, const InPlane& p) {
  return largest_eigenvalue(inverse_mass, 2, [&](const Vector& x, Vector& y) {
    y.setZero();
    for (const kernel::Triangle& t : s.triangles) {
      double eu = 0, ev = 0, g = 0;
      for (int a = 0; a < 3; ++a) {
        const double dx = x(2 * t.vertex[a]), dy = x(2 * t.vertex[a] + 1);
        eu += t.gradient_u[a] * dx;
        ev += t.gradient_v[a] * dy;
        g += t.gradient_v[a] * dx + t.gradient_u[a] * dy;
      }
      const double su = t.membrane_area * (p.ku * eu + p.coupling * ev),
                   sv = t.membrane_area * (p.kv * ev + p.coupling * eu), tau = t.membrane_area * p.shear * g;
      for (int a = 0; a < 3; ++a) {
        y(2 * t.vertex[a]) += t.gradient_u[a] * su + t.gradient_v[a] * tau;
        y(2 * t.vertex[a] + 1) += t.gradient_v[a] * sv + t.gradient_u[a] * tau;
      }
    }
    add_bending(s, p.bend, 2, x, y);
  });
}

double ratio_of(double stiffness, double damping) {
  if (stiffness <= 0) return 0;
  return damping > 0 ? stiffness / damping : std::numeric_limits<double>::infinity();
}

// T_s and its first derivative, for any argument.
std::array<double, 2> chebyshev(int s, double x) {
  double t0 = 1, t1 = x, d0 = 0, d1 = 1;
  if (s == 0) return {t0, d0};
  for (int j = 2; j <= s; ++j) {
    const double t2 = 2 * x * t1 - t0, d2 = 2 * t1 + 2 * x * d1 - d0;
    t0 = t1, t1 = t2, d0 = d1, d1 = d2;
  }
  return {t1, d1};
}

struct Polynomial {
  int count;
  double w0, w1, top;  // top: T_s(w0)

  // amplitude: |P| stays below it over the range.
  Polynomial(int s, double amplitude) : count(s), w0(s == 1 ? 1 : std::cosh(std::acosh(1 / amplitude) / s)) {
    const auto [t, d] = chebyshev(s, w0);
    top = t;
    w1 = t / d;
  }
  double at(double z) const { return chebyshev(count, w0 - w1 * z)[0] / top; }
};

// taken: of a velocity, by implicit damping.
bool mode_is_stable(const Polynomial& p, double h, double omega2, double lambda, double taken) {
  const double z = h * lambda, value = p.at(z), weight = z > 1e-9 ? (1 - value) / z : 1, left = value - taken * weight;
  return std::abs(left) <= 1 + 1e-12 && h * h * omega2 * weight <= 2 * (1 + left);
}

bool is_stable(const Polynomial& p, double h, const Spectrum& s) {
  const double taken = h * s.implicit_lambda / (1 + kImplicit * h * s.implicit_lambda);
  const int points = 30;
  for (int i = 0; i <= points; ++i) {
    const double share = static_cast<double>(i) / points;
    const double membrane = share * s.membrane_lambda, bend = share * s.bend_lambda;
    const auto bounded = [](double most, double ratio, double lambda) {
      return std::isinf(ratio) ? most : std::min(most, ratio * lambda);
    };
    if (!mode_is_stable(p, h, bounded(s.membrane_omega2, s.membrane_ratio, membrane), membrane, taken)) return false;
    if (!mode_is_stable(p, h, bounded(s.bend_omega2, s.bend_ratio, bend), bend, taken)) return false;
  }
  return mode_is_stable(p, h, s.tension * s.membrane_omega2 + s.bend_omega2, 0, taken);
}

// The longest stable step, found from below so that no island of stability is taken.
double longest_step(const Polynomial& p, const Spectrum& s) {
  double h = 0.2 / std::sqrt(std::max({s.membrane_omega2, s.bend_omega2, 1.0}));
  h = std::min(h, 0.5 / std::max({s.membrane_lambda, s.bend_lambda, 1.0}));
  const double most = 1.5 * kLongestStep_s;
  for (const double growth : {1.04, 1.01})
    while (h < most && is_stable(p, growth * h, s)) h *= growth;
  return std::min(h, most);
}

constexpr double kMargin = 0.85;
constexpr std::array<double, 3> kAmplitudes = {0.8, 0.5, 0.3};

std::vector<Polynomial> candidates(const Spectrum& spectrum) {
  std::vector<Polynomial> list = {Polynomial(1, 1)};
  for (int s = 2; s <= spectrum.most_stages; ++s)
    for (const double amplitude : kAmplitudes) list.emplace_back(s, amplitude);
  return list;
}

kernel::DampingStages stages_of(const Polynomial& p) {
  kernel::DampingStages out;
  out.count = p.count;
  const auto t = [&](int j) { return chebyshev(j, p.w0)[0]; };
  out.gain[0] = p.w1 / p.w0;
  for (int j = 2; j <= p.count; ++j) {
    out.mu[j - 1] = 2 * p.w0 * t(j - 1) / t(j);
    out.nu[j - 1] = -t(j - 2) / t(j);
    out.gain[j - 1] = 2 * p.w1 * t(j - 1) / t(j);
  }
  return out;
}

}  // namespace

Spectrum spectrum_of(const Sheet& sheet, const Material& m) {
  const kernel::SheetData& s = sheet.data;
  std::vector<double> inverse_mass;
  for (const double area : s.vertex_area) inverse_mass.push_back(1 / (m.density * area));
  // Stiffening, friction and creep add to the tangent: strains stay below a tenth, and slopes add up.
  const double extra = (1 + 0.2 * std::max(0.0, m.stretch_stiffening)) * (1 + m.creep);
  const double friction = m.stretch_friction / m.stretch_friction_strain;
  const double ku = m.stretch * std::exp(m.stretch_anisotropy) * extra + friction;
  const double kv = m.stretch * std::exp(-m.stretch_anisotropy) * extra + friction;
  const double shear = m.shear * extra + friction;
  const double bend = m.bend * std::exp(std::abs(m.bend_anisotropy)) * (1 + m.hem_stiffness) *
                          (1 + 1e3 * std::max(0.0, m.bend_stiffening)) +
                      m.bend_friction / m.bend_friction_curvature;
  Spectrum out;
  out.membrane_omega2 = in_plane_eigenvalue(s, inverse_mass, {ku, kv, m.coupling * std::sqrt(ku * kv), shear, bend});
  out.membrane_lambda =
      in_plane_eigenvalue(s, inverse_mass, {m.stretch_damping, m.stretch_damping, 0, m.shear_damping, m.bend_damping});
  out.membrane_ratio = std::max({ratio_of(std::max(ku, kv), m.stretch_damping), ratio_of(shear, m.shear_damping),
                                 ratio_of(bend, m.bend_damping)});
  const double bend_unit = largest_eigenvalue(inverse_mass, 1, [&](const Vector& x, Vector& y) {
    y.setZero();
    add_bending(s, 1, 1, x, y);
  });
  out.bend_omega2 = bend_unit * bend;
  out.bend_lambda = bend_unit * m.bend_damping;
  out.bend_ratio = ratio_of(bend, m.bend_damping);
  // A held corner carries half the weight, twice over in motion, through a cell or so.
  const double spacing = std::sqrt(s.width_m * s.height_m / static_cast<double>(s.vertex_count));
  const double weight_n = 9.81 * m.density * s.width_m * s.height_m;
  out.tension = std::clamp(0.05 + weight_n / (spacing * std::min(ku, kv)), 0.1, 1.0);
  // Arcs stiffen the shortest sideways wave under tension by 16/12 of its 4.
  if (!s.arcs.empty()) out.tension *= 4.0 / 3;
  return out;
}

StepPlan plan_step(const Spectrum& spectrum) {
  StepPlan best;
  double least = std::numeric_limits<double>::infinity();
  for (const Polynomial& p : candidates(spectrum)) {
    const double work = 1 + spectrum.stage_cost * (p.count - 1);
    if (work >= least * kLongestStep_s) break;
    if (std::isfinite(least) && !is_stable(p, work / (kMargin * least), spectrum)) continue;  // no longer than pays
    const double h = std::min(kMargin * longest_step(p, spectrum), kLongestStep_s);
    const double cost = work / h;
    if (cost >= least) continue;
    least = cost;
    best = {h, stages_of(p)};
  }
  return best;
}

kernel::DampingStages stages_for(const Spectrum& spectrum, double step_s) {
  const std::vector<Polynomial> list = candidates(spectrum);
  const double wanted = step_s * (1 - 1e-9) / kMargin;
  for (const Polynomial& p : list)
    if (is_stable(p, wanted, spectrum) && longest_step(p, spectrum) >= wanted) return stages_of(p);
  return stages_of(list.back());
}

}  // namespace selvedge::cloth
