#include "cli/verify/proofs/force_laws.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <Eigen/Dense>

#include "cloth/energy.h"
#include "cloth/kernel/force_field.h"
#include "cloth/spline/energy.h"
#include "cloth/spline/lane_run.h"

namespace selvedge::cli {

namespace {

using cloth::Material;

constexpr cloth::Sides kBothSides[] = {cloth::Sides::straight, cloth::Sides::arcs};

struct Crumpled {
  cloth::Sheet sheet;
  Eigen::Matrix3Xd x, v;

  explicit Crumpled(cloth::Sides sides)
      : sheet(cloth::make_sheet(geometry::make_irregular_mesh(0.3, 0.2, 8, 6, 0.4, 3), sides)),
        x(3, sheet.data.vertex_count), v(x) {
    std::mt19937 random(11);
    std::normal_distribution<double> noise;
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      const Eigen::Vector2d& uv = sheet.mesh.rest_uv[static_cast<size_t>(i)];
      x.col(i) << 1.03 * uv.x(), 0.97 * uv.y() + 0.1 * uv.x(), 0.3 * uv.x() * uv.x() - 0.2 * uv.y() * uv.x();
      for (int a = 0; a < 3; ++a) {
        x(a, i) += 1e-3 * noise(random);
        v(a, i) = 0.2 * noise(random);
      }
    }
  }

  // Without gravity, N.
  Eigen::Matrix3Xd forces(const Material& m, const Eigen::Matrix3Xd& velocity) const {
    cloth::kernel::Surroundings weightless;
    weightless.gravity[2] = 0;
    cloth::kernel::ForceField field(sheet.data, m, weightless);
    Eigen::Matrix3Xd a(3, x.cols());
    field.accelerations(x.data(), velocity.data(), 0, a.data());
    return a * cloth::vertex_masses(sheet, m).asDiagonal();
  }

  Eigen::Matrix3Xd still() const { return Eigen::Matrix3Xd::Zero(3, x.cols()); }
};

double difference_from_gradient(const Eigen::Matrix3Xd& force, const Eigen::Matrix3Xd& y, double step,
                                const std::function<double(const Eigen::Matrix3Xd&)>& energy) {
  double worst = 0;
  Eigen::Matrix3Xd moved = y;
  const auto slope = [&](Eigen::Index k, double h) {
    moved(k) = y(k) + h;
    const double up = energy(moved);
    moved(k) = y(k) - h;
    const double down = energy(moved);
    moved(k) = y(k);
    return (up - down) / (2 * h);
  };
  for (Eigen::Index k = 0; k < y.size(); ++k)
    worst = std::max(worst, std::abs(force(k) + (4 * slope(k, step / 2) - slope(k, step)) / 3));
  return worst / force.cwiseAbs().maxCoeff();
}

}  // namespace

Material lossless() {
  Material m;
  m.stretch_damping = m.shear_damping = m.bend_damping = 0;
  m.drag_normal = m.drag_tangent = 0;
  return m;
}

double energy_gradient_error(const Material& material, bool stretched) {
  double worst = 0;
  for (const cloth::Sides sides : kBothSides) {
    Crumpled s(sides);
    for (Eigen::Index i = 0; stretched && i < s.x.cols(); ++i)
      s.x.col(i).head<2>() = 1.2 * s.sheet.mesh.rest_uv[static_cast<size_t>(i)];
    worst = std::max(worst,
                     difference_from_gradient(s.forces(material, s.still()), s.x, 2e-5, [&](const Eigen::Matrix3Xd& x) {
                       return cloth::energy_of(s.sheet, material, Eigen::Vector3d::Zero(), x, s.still()).potential();
                     }));
  }
  return worst;
}

double spline_gradient_error(const Material& material, bool stretched) {
  namespace spline = cloth::spline;
  const spline::Swatch swatch;
  const spline::SplineSheet sheet = make_spline_sheet(swatch, make_grid(swatch, cloth::Hold::corners, 0.3 / 5));
  std::mt19937 random(11);
  std::normal_distribution<double> noise;
  const Eigen::Matrix3Xd x = control_points_through(sheet, [&](const Eigen::Vector2d& uv) -> Eigen::Vector3d {
    const Eigen::Vector3d rough = 1e-3 * Eigen::Vector3d(noise(random), noise(random), noise(random));
    const double height = 0.3 * uv.x() * uv.x() - 0.2 * uv.y() * uv.x();
    if (stretched) return Eigen::Vector3d(1.2 * uv.x(), 1.2 * uv.y(), height) + rough;
    return Eigen::Vector3d(1.03 * uv.x(), 0.97 * uv.y() + 0.1 * uv.x(), height) + rough;
  });
  cloth::Experiment e;
  e.material = material;
  e.path = cloth::make_path(cloth::Hold::corners, {0.0}, Eigen::Vector3d(-0.1, 0, 0), Eigen::Vector3d(0.1, 0, 0));
  spline::LaneRun<double> run(sheet, {&e});
  run.set_position(0, x);
  run.set_forces(0);
  const Eigen::Matrix3Xd still = Eigen::Matrix3Xd::Zero(3, x.cols());
  return difference_from_gradient(run.force(0), x, 2e-5, [&](const Eigen::Matrix3Xd& at) {
    return energy_of(sheet, material, Eigen::Vector3d::Zero(), at, still).potential();
  });
}

double damping_gradient_error(const Material& material) {
  Material undamped = material;
  undamped.stretch_damping = undamped.shear_damping = undamped.bend_damping = 0;
  double worst = 0;
  for (const cloth::Sides sides : kBothSides) {
    const Crumpled s(sides);
    worst = std::max(worst, difference_from_gradient(s.forces(material, s.v) - s.forces(undamped, s.v), s.v, 1e-2,
                                                     [&](const Eigen::Matrix3Xd& v) {
      return cloth::damping_potential(s.sheet, material, s.x, v);
                     }));
  }
  return worst;
}

Unbalanced unbalanced(const Material& material) {
  Unbalanced worst;
  for (const cloth::Sides sides : kBothSides) {
    const Crumpled s(sides);
    const Eigen::Matrix3Xd f = s.forces(material, s.v);
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < f.cols(); ++i) torque += Eigen::Vector3d(s.x.col(i)).cross(Eigen::Vector3d(f.col(i)));
    const double all = f.cwiseAbs().sum();
    worst = {std::max(worst.force, f.rowwise().sum().norm() / all), std::max(worst.torque_m, torque.norm() / all)};
  }
  return worst;
}

}  // namespace selvedge::cli
