#include "hardware_sim/world/lattice_sheet.h"

#include <array>
#include <cmath>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace selvedge::hardware_sim {
namespace {

FabricTruth only_elastic() {
  FabricTruth truth;
  truth.stretch_damping = truth.shear_damping = truth.bend_damping = 0;
  truth.drag_normal = truth.drag_tangent = 0;
  return truth;
}

// Nodes moved to where a map of flat coordinates puts them.
template <class Map>
Eigen::Matrix3Xd mapped(const LatticeSheet& sheet, Map map) {
  Eigen::Matrix3Xd position(3, sheet.count());
  const auto uv = sheet.rest_uv();
  for (int i = 0; i < sheet.count(); ++i) position.col(i) = map(uv[i].x(), uv[i].y());
  return position;
}

// On nodes that lie unevenly, every one of them moved.
TEST(SheetForces, AreTheEnergysDerivative) {
  const SheetGrid grid({0, 0.03, 0.065, 0.11, 0.16, 0.2}, {0, 0.05, 0.11, 0.15, 0.2});
  SheetForces<double> sheet(grid);
  SheetLaw law;
  law.stretch.stiffness = 110;
  law.shear.stiffness = 55;
  law.bend.stiffness = 2e-3;
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 0.004);
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.columns; ++c) {
      sheet.x[0][grid.at(r, c)] = grid.u.place[static_cast<size_t>(c)] + normal(random);
      sheet.x[1][grid.at(r, c)] = normal(random);
      sheet.x[2][grid.at(r, c)] = -grid.v.place[static_cast<size_t>(r)] + normal(random);
    }
  const auto elastic = [&] {
    const auto e = sheet.elastic(law);
    return e.stretch + e.shear + e.bend;
  };
  sheet.strain(law);
  sheet.pull(law);
  const SheetField<double> force = sheet.f;
  const double step = 1e-7;
  for (size_t a = 0; a < 3; ++a)
    for (int r = 0; r < grid.rows; ++r)
      for (int c = 0; c < grid.columns; ++c) {
        double& x = sheet.x[a][grid.at(r, c)];
        const double was = x;
        x = was + step;
        const double more = elastic();
        x = was - step;
        const double less = elastic();
        x = was;
        ASSERT_NEAR(force[a][grid.at(r, c)], -(more - less) / (2 * step), 1e-6) << a << " " << r << " " << c;
      }
}

// Fourth order inside and third at the rim: halving the cells leaves less than a fifth of the error, where second order
// would leave a quarter.
TEST(SheetForces, EnergyOfAWavySheetIsOfHighOrder) {
  const auto bend_of = [](int cells) {
    std::vector<double> place;
    for (int i = 0; i <= cells; ++i) place.push_back(0.3 * i / cells + 0.01 * std::sin(M_PI * i / cells));
    const SheetGrid grid(place, place);
    SheetForces<double> sheet(grid);
    for (int r = 0; r < grid.rows; ++r)
      for (int c = 0; c < grid.columns; ++c) {
        const double u = place[static_cast<size_t>(c)], v = place[static_cast<size_t>(r)];
        sheet.x[0][grid.at(r, c)] = u;
        sheet.x[1][grid.at(r, c)] = 0.01 * std::sin(40 * u + 1) * std::cos(30 * v);
        sheet.x[2][grid.at(r, c)] = -v;
      }
    SheetLaw law;
    law.bend.stiffness = 1;
    law.stretch.stiffness = 1;
    law.shear.stiffness = 1;
    const auto e = sheet.elastic(law);
    return std::array{e.bend, e.stretch, e.shear};
  };
  const auto coarse = bend_of(16), fine = bend_of(32), finest = bend_of(128);
  for (size_t k = 0; k < 3; ++k)
    EXPECT_LT(std::abs(fine[k] - finest[k]), 0.2 * std::abs(coarse[k] - finest[k]) + 1e-5 * finest[k]) << k;
}

TEST(LatticeSheet, StretchShearAndBendMeanWhatTheFormatSays) {
  const FabricTruth truth = only_elastic();
  LatticeSheet sheet(truth);
  const double area = truth.width_m * truth.height_m;

  // 1 % along u: half stretch strain², to first order in the strain.
  sheet.set_position(mapped(sheet, [](double u, double v) { return Eigen::Vector3d(1.01 * u, 0, -v); }));
  EXPECT_NEAR(sheet.energy().stretch / area / (0.5 * truth.stretch * 1e-4), 1, 0.02);
  sheet.set_position(mapped(sheet, [](double u, double v) { return Eigen::Vector3d(u + 0.01 * v, 0, -v); }));
  EXPECT_NEAR(sheet.energy().shear / area / (0.5 * truth.shear * 1e-4), 1, 0.02);

  // A cylinder of radius R about either axis, and about a diagonal one: half B κ².
  const double radius = 0.08;
  for (const double turn : {0.0, M_PI / 2, M_PI / 4}) {
    sheet.set_position(mapped(sheet, [&](double u, double v) {
      const double along = u * std::cos(turn) + v * std::sin(turn), across = -u * std::sin(turn) + v * std::cos(turn);
      return Eigen::Vector3d(radius * std::sin(along / radius), radius * std::cos(along / radius), across);
    }));
    EXPECT_NEAR(sheet.energy().bend / area / (0.5 * truth.bend / (radius * radius)), 1, 0.05)
        << "axis turned by " << turn;
  }
}

TEST(LatticeSheet, FallsAtTheSpeedWhereDragCarriesTheWeight) {
  FabricTruth truth;
  truth.drag_fade = 0;
  LatticeSheet sheet(truth, {.cells_across = 6, .cells_down = 6});
  // Flat and level, so that all drag is normal: ρ g = drag_normal v².
  sheet.set_position(mapped(sheet, [](double u, double v) { return Eigen::Vector3d(u, -v, 0); }));
  for (int i = 0; i < 40; ++i) sheet.advance_free(0.05);
  const double speed = -sheet.velocity().row(2).mean();
  EXPECT_NEAR(speed, std::sqrt(truth.density * 9.81 / truth.drag_normal), 0.005);
}

TEST(LatticeSheet, SwingsWithThePeriodOfARigidPlateAndKeepsItsEnergy) {
  FabricTruth truth = only_elastic();
  truth.bend = 5e-2;  // stiff enough to move as one
  truth.stretch = truth.shear = 2000;
  LatticeSheet sheet(truth, {.cells_across = 12, .cells_down = 12});
  const Eigen::Vector3d left(0, 0, 0), right(truth.width_m, 0, 0);
  const double tilt = 0.1;
  sheet.set_position(
      mapped(sheet, [&](double u, double v) { return Eigen::Vector3d(u, v * std::sin(tilt), -v * std::cos(tilt)); }));
  const auto total = [&] {
    const LatticeEnergy e = sheet.energy();
    return e.stretch + e.shear + e.bend + e.kinetic + e.weight;
  };
  const double start = total();
  // Upward and downward crossings of the plumb line by the lower edge.
  const int low = sheet.count() - sheet.columns() / 2 - 1;
  std::vector<double> crossings;
  double last = sheet.position()(1, low);
  const double step = 0.002;
  for (double t = 0; t < 4.5; t += step) {
    sheet.advance(step, left, right);
    const double here = sheet.position()(1, low);
    if ((here > 0) != (last > 0)) crossings.push_back(t + step * last / (last - here));
    last = here;
  }
  ASSERT_GE(crossings.size(), 8u);
  const double period = 2 * (crossings.back() - crossings.front()) / double(crossings.size() - 1);
  const double expected = 2 * M_PI * std::sqrt(2 * truth.height_m / (3 * 9.81)) * (1 + tilt * tilt / 16);
  EXPECT_NEAR(period / expected, 1, 0.01);
  const double swing =
      truth.density * truth.width_m * truth.height_m * 9.81 * truth.height_m / 2 * (1 - std::cos(tilt));
  EXPECT_NEAR((total() - start) / swing, 0, 0.03);
}

// Damping of the membrane and of bending does not set the step.
TEST(LatticeSheet, AStronglyDampedFabricTakesStepsThatItStands) {
  FabricTruth truth;
  truth.density = 0.141;
  truth.stretch = 97;
  truth.shear = 69;
  truth.bend = 6.9e-5;
  truth.bend_damping = 8.5e-7;
  const Eigen::Vector3d left(-0.1225, 0, 0), right(0.1225, 0, 0);
  const auto hung = [&](double step_share) {
    LatticeSheet sheet(truth, {.cells_across = 22, .cells_down = 22, .step_share = step_share});
    sheet.hang(left, right, {0, 1, 0});
    sheet.advance(0.1, left, right, 20);
    return sheet;
  };
  const LatticeSheet sheet = hung(LatticeOptions().step_share);
  ASSERT_TRUE(sheet.position().allFinite());
  EXPECT_LT(sheet.velocity().colwise().norm().maxCoeff(), 1);
  EXPECT_FALSE(hung(2).position().allFinite()) << "the bound says little";
  FabricTruth undamped = truth;
  undamped.stretch_damping = undamped.shear_damping = undamped.bend_damping = 0;
  EXPECT_GT(sheet.largest_step_s(),
            0.5 * LatticeSheet(undamped, {.cells_across = 22, .cells_down = 22}).largest_step_s());
}

// A cylinder: no edge is longer or shorter than it is at rest, and no cell is sheared.
TEST(LatticeSheet, HangsUnstrained) {
  LatticeSheet sheet({});
  sheet.hang({-0.12, 0, 1}, {0.12, 0.01, 1}, {0, 1, 0});
  const LatticeEnergy e = sheet.energy();
  EXPECT_LT(e.stretch + e.shear, 1e-3 * e.bend);
  EXPECT_NEAR((sheet.position().col(sheet.columns() - 1) - Eigen::Vector3d(0.12, 0.01, 1)).norm(), 0, 1e-7);
}

// What the rig moves is the plane of a patch, on every lattice.
TEST(LatticeSheet, GripsGoWhereTheyAreLed) {
  for (const int cells : {12, 30}) {
    LatticeSheet sheet({}, {.cells_across = cells, .cells_down = cells});
    const Eigen::Vector3d left(-0.12, 0, 0);
    Eigen::Vector3d right(0.12, 0, 0);
    sheet.hang(left, right, {0, 1, 0});
    EXPECT_NEAR((sheet.held_right(sheet.position()) - right).norm(), 0, 1e-5);
    for (int i = 1; i <= 48; ++i) {
      right.y() = 0.02 * std::sin(i / 10.0);
      sheet.advance(1.0 / 480, left, right);
      EXPECT_NEAR((sheet.held_right(sheet.position()) - right).norm(), 0, 1e-6) << cells;
      EXPECT_NEAR((sheet.held_left(sheet.position()) - left).norm(), 0, 1e-6) << cells;
    }
  }
}

}  // namespace
}  // namespace selvedge::hardware_sim
