// Known answers on coarse meshes; `./selvedge prove cloth` shows them on fine ones.
#include <gtest/gtest.h>

#include "cli/verify/proofs/cloth_cases.h"

namespace selvedge::cli {
namespace {

TEST(Cantilever, SagsAsTheElastica) {
  const Compared coarse = cantilever_sag(13), fine = cantilever_sag(25);
  EXPECT_GT(fine.reference, 0.1);
  EXPECT_LT(coarse.relative_error(), 0.03);
  EXPECT_LT(fine.relative_error(), 0.01);
}

TEST(SplineClosedForms, AreMetOnFewCells) {
  EXPECT_LT(spline_cantilever_sag(6).relative_error(), 0.005);
  EXPECT_LT(spline_catenary_sag(12).relative_error(), 0.01);
  EXPECT_LT(spline_pendulum_period(14).relative_error(), 0.002);
}

TEST(Catenary, SagsAsAChain) { EXPECT_LT(catenary_sag(17).relative_error(), 0.02); }

TEST(Pendulum, SwingsAsAHangingChain) { EXPECT_LT(pendulum_period(17).relative_error(), 0.01); }

TEST(FreeFall, ReachesItsTerminalSpeed) { EXPECT_LT(terminal_speed(9).relative_error(), 1e-3); }

TEST(Bending, OfACylinderIsTheSameWhicheverWayItIsRolled) {
  for (const double angle : {0.0, 0.5, 0.7854, 1.5708}) {
    EXPECT_LT(cylinder_energy(geometry::make_grid_mesh(0.3, 0.3, 33, 33), angle).relative_error(), 0.02) << angle;
    EXPECT_LT(cylinder_energy(geometry::make_irregular_mesh(0.3, 0.3, 33, 33, 0.4, 2), angle).relative_error(), 0.02)
        << angle;
  }
}

TEST(Energy, OfAnUndampedSheetStays) { EXPECT_LT(energy_drift(9, 2), 1e-3); }

}  // namespace
}  // namespace selvedge::cli
