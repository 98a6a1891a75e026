// Forces against the energies that they come from, and what they conserve.
#include <random>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "cloth/energy.h"
#include "cloth/kernel/force_field.h"

namespace selvedge::cloth {
namespace {

Material plain() {
  Material m;
  m.stretch_damping = m.shear_damping = m.bend_damping = 0;
  m.drag_normal = m.drag_tangent = 0;
  return m;
}

struct Shaken {
  Sheet sheet = make_sheet(geometry::make_irregular_mesh(0.3, 0.2, 8, 6, 0.4, 3));
  Eigen::Matrix3Xd x, v;
  Shaken() : x(3, sheet.data.vertex_count), v(x) {
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

  // Forces without gravity, N.
  Eigen::Matrix3Xd forces(const Material& m, const Eigen::Matrix3Xd& velocity) const {
    kernel::Surroundings weightless;
    weightless.gravity[2] = 0;
    kernel::ForceField field(sheet.data, m, weightless);
    Eigen::Matrix3Xd a(3, x.cols());
    field.accelerations(x.data(), velocity.data(), 0, a.data());
    return a * vertex_masses(sheet, m).asDiagonal();
  }
};

double potential(const Sheet& sheet, const Material& m, const Eigen::Matrix3Xd& x) {
  return energy_of(sheet, m, Eigen::Vector3d::Zero(), x, Eigen::Matrix3Xd::Zero(3, x.cols())).potential();
}

// Largest difference of a force from −∂f/∂y by central differences with Richardson's extrapolation, relative
// to the largest force.
template <class Function>
double difference_from_gradient(const Eigen::Matrix3Xd& force, const Eigen::Matrix3Xd& y, const Function& f, double step) {
  double worst = 0;
  Eigen::Matrix3Xd moved = y;
  const auto slope = [&](Eigen::Index k, double h) {
    moved(k) = y(k) + h;
    const double up = f(moved);
    moved(k) = y(k) - h;
    const double down = f(moved);
    moved(k) = y(k);
    return (up - down) / (2 * h);
  };
  for (Eigen::Index k = 0; k < y.size(); ++k)
    worst = std::max(worst, std::abs(force(k) + (4 * slope(k, step / 2) - slope(k, step)) / 3));
  return worst / force.cwiseAbs().maxCoeff();
}

TEST(Forces, AreMinusTheGradientOfTheirEnergy) {
  const Shaken s;
  std::vector<Material> materials(6, plain());
  materials[1].stretch_anisotropy = 0.4;
  materials[1].coupling = 0.3;
  materials[2].bend_anisotropy = 0.5;
  materials[3].hem_stiffness = 3;
  materials[4].bend_stiffening = 1e-3;
  materials[5].stretch = materials[5].shear = 0;  // bending alone
  materials[5].bend = 1e-3;
  for (size_t i = 0; i < materials.size(); ++i) {
    const Material& m = materials[i];
    const double error = difference_from_gradient(s.forces(m, Eigen::Matrix3Xd::Zero(3, s.x.cols())), s.x,
                                                  [&](const auto& x) { return potential(s.sheet, m, x); }, 2e-5);
    EXPECT_LT(error, 1e-6) << "material " << i;
  }
}

TEST(Forces, StiffeningIsTheGradientOfItsEnergyAwayFromZeroStrain) {
  Shaken s;
  for (Eigen::Index i = 0; i < s.x.cols(); ++i) s.x.col(i).head<2>() = 1.2 * s.sheet.mesh.rest_uv[static_cast<size_t>(i)];
  Material m = plain();
  m.stretch_stiffening = 5;
  EXPECT_LT(difference_from_gradient(s.forces(m, Eigen::Matrix3Xd::Zero(3, s.x.cols())), s.x,
                                     [&](const auto& x) { return potential(s.sheet, m, x); }, 2e-5),
            1e-6);
}

TEST(Forces, DampingIsMinusTheGradientOfItsPower) {
  const Shaken s;
  Material damped = plain();
  damped.stretch_damping = 0.04;
  damped.shear_damping = 0.02;
  damped.bend_damping = 1e-5;
  const Eigen::Matrix3Xd force = s.forces(damped, s.v) - s.forces(plain(), s.v);
  EXPECT_LT(difference_from_gradient(force, s.v, [&](const auto& v) { return damping_potential(s.sheet, damped, s.x, v); }, 1e-2),
            1e-6);
}

TEST(Forces, OfTheFabricMoveAndTurnNothing) {
  const Shaken s;
  Material m = plain();
  m.stretch_damping = m.shear_damping = 0.04;
  m.coupling = 0.2;
  const Eigen::Matrix3Xd f = s.forces(m, s.v);
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < f.cols(); ++i) torque += Eigen::Vector3d(s.x.col(i)).cross(Eigen::Vector3d(f.col(i)));
  EXPECT_LT(f.rowwise().sum().norm(), 1e-12 * f.cwiseAbs().sum());
  EXPECT_LT(torque.norm(), 1e-12 * f.cwiseAbs().sum());
}

TEST(Forces, DragOpposesTheMotionRelativeToTheAir) {
  const Sheet sheet = make_sheet(geometry::make_grid_mesh(0.3, 0.3, 7, 7));
  Material m = plain();
  m.drag_normal = 1.05;
  m.drag_tangent = 0.05;
  m.drag_linear = 0.3;
  kernel::Surroundings air;
  air.gravity[2] = 0;
  air.air_velocity[2] = 0.5;
  Eigen::Matrix3Xd x(3, sheet.data.vertex_count), v(x), a(x);
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    x.col(i) << sheet.mesh.rest_uv[static_cast<size_t>(i)], 0;
    v.col(i) << 0.4, 0, -1;
  }
  kernel::ForceField(sheet.data, m, air).accelerations(x.data(), v.data(), 0, a.data());
  const Eigen::Vector3d total = a * vertex_masses(sheet, m), expected =
      0.09 * Eigen::Vector3d(-0.05 * 0.4, 0, 1.05 * 1.5 * 1.5 / (1 + 0.2 * 1.5 * 1.5) + 0.3 * 1.5);
  EXPECT_LT((total - expected).norm(), 1e-12);
}

}  // namespace
}  // namespace selvedge::cloth
