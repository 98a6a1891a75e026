// Forces against the energies that they come from, and what they conserve.
#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "cli/proofs/force_laws.h"
#include "cloth/energy.h"
#include "cloth/kernel/force_field.h"

namespace selvedge::cloth {
namespace {

TEST(Forces, AreMinusTheGradientOfTheirEnergy) {
  std::vector<Material> materials(6, cli::lossless());
  materials[1].stretch_anisotropy = 0.4;
  materials[1].coupling = 0.3;
  materials[2].bend_anisotropy = 0.5;
  materials[3].hem_stiffness = 3;
  materials[4].bend_stiffening = 1e-3;
  materials[5].stretch = materials[5].shear = 0;  // bending alone
  materials[5].bend = 1e-3;
  for (size_t i = 0; i < materials.size(); ++i) EXPECT_LT(cli::energy_gradient_error(materials[i]), 1e-6) << "material " << i;
}

TEST(Forces, StiffeningIsTheGradientOfItsEnergyAwayFromZeroStrain) {
  Material m = cli::lossless();
  m.stretch_stiffening = 5;
  EXPECT_LT(cli::energy_gradient_error(m, true), 1e-6);
}

TEST(Forces, DampingIsMinusTheGradientOfItsPower) {
  Material m = cli::lossless();
  m.stretch_damping = 0.04;
  m.shear_damping = 0.02;
  m.bend_damping = 1e-5;
  EXPECT_LT(cli::damping_gradient_error(m), 1e-6);
}

TEST(Forces, OfTheFabricMoveAndTurnNothing) {
  Material m = cli::lossless();
  m.stretch_damping = m.shear_damping = 0.04;
  m.coupling = 0.2;
  const cli::Unbalanced u = cli::unbalanced(m);
  EXPECT_LT(u.force, 1e-12);
  EXPECT_LT(u.torque_m, 1e-12);
}

TEST(Forces, DragOpposesTheMotionRelativeToTheAir) {
  const Sheet sheet = make_sheet(geometry::make_grid_mesh(0.3, 0.3, 7, 7));
  Material m = cli::lossless();
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
