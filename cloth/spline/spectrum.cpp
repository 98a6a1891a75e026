#include "cloth/spline/spectrum.h"

#include <algorithm>
#include <cmath>
#include <compare>
#include <limits>
#include <map>
#include <utility>

#include <Eigen/Dense>
#include <tbb/parallel_for.h>

namespace selvedge::cloth::spline {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Values and slopes of the functions of one side at its points.
struct AtPoints {
  MatrixXd value, slope;

  explicit AtPoints(const Side& side)
      : value(MatrixXd::Zero(static_cast<Index>(side.alive.size()), side.basis.count())), slope(value) {
    for (size_t q = 0; q < side.alive.size(); ++q)
      for (Index k = 0; k <= kDegree; ++k) {
        value(static_cast<Index>(q), side.alive[q].first + k) = side.alive[q].of[0][static_cast<size_t>(k)];
        slope(static_cast<Index>(q), side.alive[q].first + k) = side.alive[q].of[1][static_cast<size_t>(k)];
      }
  }
};

struct InPlane {
  double ku, kv, coupling, shear, bend;
};

// Largest eigenvalue of mass⁻¹ stiffness in the plane, density 1, by power iteration.
double in_plane_eigenvalue(const SplineSheet& sheet, const InPlane& p) {
  const AtPoints u(sheet.u), v(sheet.v);
  const MatrixXd weight = Eigen::Map<const Eigen::VectorXd>(sheet.u.rule.weight.data(), u.value.rows()) *
                          Eigen::Map<const Eigen::RowVectorXd>(sheet.v.rule.weight.data(), v.value.rows());
  MatrixXd x(sheet.columns(), sheet.rows()), y(sheet.columns(), sheet.rows());
  for (Index i = 0; i < x.size(); ++i) {  // a rough start that holds every mode
    x(i) = std::sin(12.9898 * static_cast<double>(i + 1)) + (i % 2 ? 0.5 : -0.5);
    y(i) = std::sin(78.233 * static_cast<double>(i + 1)) + (i % 3 ? 0.5 : -0.5);
  }
  const auto bending = [&](const MatrixXd& z) -> MatrixXd {
    return p.bend *
           (sheet.u.bend * z * sheet.v.mass + 2 * sheet.u.slope * z * sheet.v.slope + sheet.u.mass * z * sheet.v.bend);
  };
  double value = 0;
  for (int k = 0; k < 40; ++k) {
    const double size = std::sqrt(x.squaredNorm() + y.squaredNorm());
    x /= size;
    y /= size;
    const MatrixXd eu = u.slope * x * v.value.transpose(), ev = u.value * y * v.slope.transpose();
    const MatrixXd skew =
        p.shear * weight.cwiseProduct(u.value * x * v.slope.transpose() + u.slope * y * v.value.transpose());
    const MatrixXd su = weight.cwiseProduct(p.ku * eu + p.coupling * ev),
                   sv = weight.cwiseProduct(p.kv * ev + p.coupling * eu);
    const MatrixXd fx = u.slope.transpose() * su * v.value + u.value.transpose() * skew * v.slope + bending(x);
    const MatrixXd fy = u.value.transpose() * sv * v.slope + u.slope.transpose() * skew * v.value + bending(y);
    x = sheet.u.inverse * fx * sheet.v.inverse;
    y = sheet.u.inverse * fy * sheet.v.inverse;
    value = std::sqrt(x.squaredNorm() + y.squaredNorm());
  }
  return 1.05 * value;  // forty iterations come within a few percent from below
}

double ratio_of(double stiffness, double damping) {
  if (stiffness <= 0) return 0;
  return damping > 0 ? stiffness / damping : std::numeric_limits<double>::infinity();
}

// All that the fastest motions feel of a material.
struct Felt {
  double density, ku, kv, coupling, shear, bend, stretch_damping, shear_damping, bend_damping;
  auto operator<=>(const Felt&) const = default;
};

Felt felt_of(const Material& m) {
  // What adds to the tangent, as for triangles.
  const double extra = (1 + 0.2 * std::max(0.0, m.stretch_stiffening)) * (1 + m.creep);
  const double friction = m.stretch_friction / m.stretch_friction_strain;
  const double ku = m.stretch * std::exp(m.stretch_anisotropy) * extra + friction;
  const double kv = m.stretch * std::exp(-m.stretch_anisotropy) * extra + friction;
  const double bend = m.bend * std::exp(std::abs(m.bend_anisotropy)) * (1 + std::max(0.0, m.hem_stiffness)) *
                          (1 + 1e3 * std::max(0.0, m.bend_stiffening)) +
                      m.bend_friction / m.bend_friction_curvature;
  return {m.density,
          ku,
          kv,
          m.coupling * std::sqrt(ku * kv),
          m.shear * extra + friction,
          bend,
          m.stretch_damping,
          m.shear_damping,
          m.bend_damping};
}

Spectrum spectrum_of(const SplineSheet& sheet, const Felt& m) {
  Spectrum out;
  out.most_stages = cloth::kernel::DampingStages::kMost;
  out.stage_cost = 0.35;  // a stage asks for the membrane's damping alone
  out.membrane_omega2 = in_plane_eigenvalue(sheet, {m.ku, m.kv, m.coupling, m.shear, m.bend}) / m.density;
  out.membrane_lambda =
      in_plane_eigenvalue(sheet, {m.stretch_damping, m.stretch_damping, 0, m.shear_damping, 0}) / m.density;
  out.membrane_ratio = std::max(ratio_of(std::max(m.ku, m.kv), m.stretch_damping), ratio_of(m.shear, m.shear_damping));
  out.bend_omega2 = sheet.bend_omega2 * m.bend / m.density;
  out.bend_ratio = std::numeric_limits<double>::infinity();  // its damping is implicit (lane_run.h)
  out.implicit_lambda = sheet.bend_omega2 * m.bend_damping / m.density;
  // A held corner carries half the weight, twice over in motion, through its grip.
  const double weight_n = 9.81 * m.density * sheet.swatch.width_m * sheet.swatch.height_m;
  const double across = std::max(2 * sheet.swatch.grip_m, sheet.swatch.width_m / sheet.u.basis.cells());
  out.tension = std::clamp(0.05 + weight_n / (across * std::min(m.ku, m.kv)), 0.1, 1.0);
  // The plan looks at tension where nothing damps; it stiffens what is damped as well.
  out.membrane_omega2 *= 1 + out.tension;
  out.membrane_ratio *= 1 + out.tension;
  return out;
}

}  // namespace

std::vector<Spectrum> spectra_of(const SplineSheet& sheet, const std::vector<Material>& materials) {
  std::map<Felt, Spectrum> known;
  for (const Material& m : materials) known.try_emplace(felt_of(m));
  std::vector<std::pair<const Felt, Spectrum>*> wanted;
  for (auto& entry : known) wanted.push_back(&entry);
  tbb::parallel_for(size_t{0}, wanted.size(),
                    [&](size_t i) { wanted[i]->second = spectrum_of(sheet, wanted[i]->first); });
  std::vector<Spectrum> out;
  for (const Material& m : materials) out.push_back(known.at(felt_of(m)));
  return out;
}

}  // namespace selvedge::cloth::spline
