// What lies between vertices: arcs for sides, curved surfaces for points, and the quick way to an equilibrium.
#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "cloth/energy.h"
#include "cloth/settle.h"
#include "cloth/surface_point.h"

namespace selvedge::cloth {
namespace {

geometry::TriangleMesh swatch(int n) { return geometry::make_grid_mesh(0.3, 0.3, n, n); }

// The swatch rolled about an axis at an angle to u, without stretch.
Eigen::Matrix3Xd rolled(const geometry::TriangleMesh& mesh, double radius_m, double angle_rad) {
  Eigen::Matrix3Xd x(3, static_cast<Eigen::Index>(mesh.rest_uv.size()));
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Eigen::Vector2d uv = Eigen::Rotation2Dd(angle_rad) * mesh.rest_uv[static_cast<size_t>(i)];
    x.col(i) << radius_m * std::sin(uv.x() / radius_m), radius_m * (1 - std::cos(uv.x() / radius_m)), uv.y();
  }
  return x;
}

double membrane_energy(const Sheet& sheet, const Eigen::Matrix3Xd& x) {
  const Energy e = energy_of(sheet, {}, Eigen::Vector3d::Zero(), x, Eigen::Matrix3Xd::Zero(3, x.cols()));
  return e.stretch + e.shear;
}

TEST(Arcs, ARolledSheetIsHardlyStretchedWhicheverWayItIsRolled) {
  for (const double angle : {0.0, 0.4, 0.7854, 1.5708}) {
    const geometry::TriangleMesh mesh = swatch(17);
    const Eigen::Matrix3Xd x = rolled(mesh, 0.06, angle);
    const double straight = membrane_energy(make_sheet(mesh, Sides::straight), x),
                 arcs = membrane_energy(make_sheet(mesh, Sides::arcs), x);
    EXPECT_LT(arcs, 0.02 * straight) << angle;
  }
}

Experiment hung(const Sheet& sheet) {
  Experiment e;
  Eigen::Matrix3Xd left(3, 1), right(3, 1);
  left << -0.1275, 0, 0;
  right << 0.1275, 0, 0;
  e.path = make_path(Hold::corners, {0.0}, left, right);
  e.start_shape = hung_shape(sheet, e, 1);
  return e;
}

// With equal parameters a sheet of 13 columns hangs nearer to one of 33 with arcs than with straight sides.
TEST(Arcs, ACoarseSheetHangsAsAFineOne) {
  const Sheet fine = make_sheet(swatch(33), Sides::arcs);
  const Eigen::Matrix3Xd reference = relax(fine, {hung(fine)})[0].position;
  const auto apart_mm = [&](Sides sides) {
    const Sheet coarse = make_sheet(swatch(13), sides);
    const Eigen::Matrix3Xd x = relax(coarse, {hung(coarse)})[0].position;
    double sum = 0;
    for (size_t i = 0; i < coarse.mesh.rest_uv.size(); ++i)
      sum += (x.col(static_cast<Eigen::Index>(i)) - position_of(surface_point(fine, coarse.mesh.rest_uv[i]), reference))
                 .squaredNorm();
    return 1e3 * std::sqrt(sum / static_cast<double>(x.cols()));
  };
  EXPECT_LT(apart_mm(Sides::arcs), 0.8 * apart_mm(Sides::straight));
}

TEST(SurfacePoint, IsExactWherePositionIsAQuadratic) {
  for (const geometry::TriangleMesh& mesh : {swatch(9), geometry::make_irregular_mesh(0.3, 0.3, 9, 9, 0.4, 3)}) {
    const Sheet sheet = make_sheet(mesh);
    const auto quadratic = [](const Eigen::Vector2d& uv) {
      return Eigen::Vector3d(uv.x(), uv.y() - 2 * uv.x() * uv.x(), 1 + uv.x() * uv.y() + 3 * uv.y() * uv.y());
    };
    Eigen::Matrix3Xd x(3, static_cast<Eigen::Index>(mesh.rest_uv.size()));
    for (Eigen::Index i = 0; i < x.cols(); ++i) x.col(i) = quadratic(mesh.rest_uv[static_cast<size_t>(i)]);
    for (const Eigen::Vector2d& uv :
         {Eigen::Vector2d(0.031, 0.02), Eigen::Vector2d(0.14, 0.17), Eigen::Vector2d(0.29, 0.001)})
      EXPECT_LT((position_of(surface_point(sheet, uv), x) - quadratic(uv)).norm(), 1e-12);
  }
}

TEST(Settle, ComesToTheSameRestAsMotion) {
  const Sheet sheet = make_sheet(swatch(11), Sides::arcs);
  const Experiment e = hung(sheet);
  const Eigen::Matrix3Xd before = relax(sheet, {e})[0].position;
  Experiment stiffer = e;
  stiffer.material.bend *= 1.3;
  stiffer.material.bend_friction = 2e-5;
  const Settled settled = settle(sheet, stiffer, before, 1e-6);
  ASSERT_TRUE(settled.at_rest);
  EXPECT_GT((settled.position - before).colwise().norm().maxCoeff(), 3e-4);
  // Where it settled nothing moves.
  stiffer.start_shape = settled.position;
  stiffer.starts_at_rest = false;
  stiffer.sample_s = {0.3};
  const Eigen::Matrix3Xd later = simulate(sheet, {stiffer})[0].samples.back();
  EXPECT_LT((later - settled.position).colwise().norm().maxCoeff(), 2e-5);
}

TEST(Settle, LeavesAFarStartToOthers) {
  const Sheet sheet = make_sheet(swatch(11), Sides::arcs);
  Experiment e = hung(sheet);
  e.start_shape.row(2) *= -1;  // hung upwards
  EXPECT_FALSE(settle(sheet, e, e.start_shape, 1e-6).at_rest);
  EXPECT_TRUE(relax(sheet, {e})[0].at_rest);
}

}  // namespace
}  // namespace selvedge::cloth
