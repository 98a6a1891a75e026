// Forces against the energies that they come from, and what they conserve.
#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "cli/verify/proofs/force_laws.h"
#include "cloth/energy.h"
#include "cloth/kernel/force_field.h"
#include "cloth/stiffening.h"

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
  for (size_t i = 0; i < materials.size(); ++i)
    EXPECT_LT(cli::energy_gradient_error(materials[i]), 1e-6) << "material " << i;
}

TEST(Forces, StiffeningIsTheGradientOfItsEnergyAwayFromZeroStrain) {
  Material m = cli::lossless();
  for (const double beta : {5.0, -1.5}) {
    m.stretch_stiffening = beta;
    EXPECT_LT(cli::energy_gradient_error(m, true), 1e-6) << beta;
  }
}

TEST(Stiffening, OfEnergyStressAndSlopeAreOneLaw) {
  for (const double beta : {6.0, 1.5, 0.0, -0.01, -1.5, -4.0})
    for (const double strain : {-0.3, -0.02, 0.05, 0.4, 1.2}) {
      const double h = 1e-6, stress = strain * stretch_factor(beta, strain);
      EXPECT_NEAR((stretch_energy(beta, strain + h) - stretch_energy(beta, strain - h)) / (2 * h), stress, 1e-8);
      EXPECT_NEAR(
          ((strain + h) * stretch_factor(beta, strain + h) - (strain - h) * stretch_factor(beta, strain - h)) / (2 * h),
          stretch_slope(beta, strain), 1e-8);
      EXPECT_GT(stretch_slope(beta, strain), 0) << "softer, and never unstable";
    }
  EXPECT_NEAR(stretch_energy(-1, 0.999e-3), stretch_energy(-1, 1.001e-3), 3e-9) << "where the series begins";
}

TEST(Stiffening, OfALogarithmOfLengthIsMinusOneAndAHalf) {
  for (const double strain : {0.02, 0.1, 0.2}) {
    const double stress = std::log1p(strain) / (1 + strain);  // of ½ ln² λ
    EXPECT_NEAR(strain * stretch_factor(-1.5, strain), stress, 0.015 * stress) << strain;
    EXPECT_GT(std::abs(strain - stress), 0.02 * stress);
  }
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
  const Eigen::Vector3d total = a * vertex_masses(sheet, m),
                        expected = 0.09 * Eigen::Vector3d(-0.05 * 0.4, 0,
                                                          1.05 * 1.5 * 1.5 / (1 + 0.2 * 1.5 * 1.5) + 0.3 * 1.5);
  EXPECT_LT((total - expected).norm(), 1e-12);
}

// Σ A (uu² + 2 uv² + vv²) of one coordinate of each vertex, straight from the stencils.
double bending_energy(const kernel::SheetData& s, const Eigen::VectorXd& x) {
  double sum = 0;
  for (size_t i = 0; i < static_cast<size_t>(s.vertex_count); ++i) {
    double uu = 0, uv = 0, vv = 0;
    for (auto k = static_cast<size_t>(s.bend.start[i]); k < static_cast<size_t>(s.bend.start[i + 1]); ++k) {
      const double value = x(s.bend.index[k]);
      uu += s.bend.uu[k] * value;
      uv += s.bend.uv[k] * value;
      vv += s.bend.vv[k] * value;
    }
    sum += s.vertex_area[i] * (uu * uu + 2 * uv * uv + vv * vv);
  }
  return sum;
}

TEST(BendMatrix, HoldsTheStencilsEnergyAndJoinsRowsThatAreAlike) {
  const Sheet regular = make_sheet(geometry::make_grid_mesh(0.3, 0.3, 17, 17));
  const Sheet irregular = make_sheet(geometry::make_irregular_mesh(0.3, 0.3, 17, 17, 0.4, 2));
  for (const Sheet* sheet : {&regular, &irregular}) {
    const kernel::BendMatrix& m = sheet->data.bend_matrix;
    int rows = 0;
    for (const auto& alike : m.alike) {
      EXPECT_EQ(alike.first, rows);
      rows += alike.count;
    }
    EXPECT_EQ(rows, sheet->data.vertex_count);
    const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(rows, 0, 40).array().sin();
    double product = 0;
    for (int i = 0; i < rows; ++i)
      for (int k = m.start[static_cast<size_t>(i)]; k < m.start[static_cast<size_t>(i) + 1]; ++k)
        product += x(i) * m.value[static_cast<size_t>(k)] * x(m.index[static_cast<size_t>(k)]);
    EXPECT_NEAR(product / bending_energy(sheet->data, x), 1, 1e-8);
  }
  EXPECT_LT(regular.data.bend_matrix.alike.size(), static_cast<size_t>(regular.data.vertex_count) / 2);
}

}  // namespace
}  // namespace selvedge::cloth
