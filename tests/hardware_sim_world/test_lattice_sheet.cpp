#include "hardware_sim/world/lattice_sheet.h"

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

TEST(LatticeSheet, ForcesAreTheEnergysDerivative) {
  FabricTruth truth = only_elastic();
  truth.bend = 2e-3;
  LatticeSheet sheet(truth, {.cells_across = 5, .cells_down = 4});
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 0.004);
  Eigen::Matrix3Xd position = sheet.position();
  for (Eigen::Index i = 0; i < position.size(); ++i) position.data()[i] += normal(random);
  // The bending force takes edges for inextensible; in the energy used here that makes no difference, since both
  // use the rest length.
  sheet.set_position(position);
  const Eigen::Matrix3Xd force = sheet.internal_forces();
  const double step = 1e-7;
  for (Eigen::Index i = 0; i < position.size(); ++i) {
    Eigen::Matrix3Xd moved = position;
    const auto elastic = [&](double by) {
      moved.data()[i] = position.data()[i] + by;
      sheet.set_position(moved);
      const LatticeEnergy e = sheet.energy();
      return e.stretch + e.shear + e.bend;
    };
    const double derivative = (elastic(step) - elastic(-step)) / (2 * step);
    ASSERT_NEAR(force.data()[i], -derivative, 1e-6 * std::max(1.0, force.cwiseAbs().maxCoeff())) << i;
  }
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
  EXPECT_NEAR((total() - start) / swing, 0, 0.02);
}

// Bending's damping brakes waves in the plane as well, and takes its part of the step.
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
    sheet.hang_unstrained(left, right, {0, 1, 0});
    sheet.advance(0.1, left, right, 20);
    return sheet;
  };
  const LatticeSheet sheet = hung(LatticeOptions().step_share);
  ASSERT_TRUE(sheet.position().allFinite());
  EXPECT_LT(sheet.velocity().colwise().norm().maxCoeff(), 1);
  EXPECT_FALSE(hung(2).position().allFinite()) << "the bound says little";
}

// A cylinder: no edge is longer or shorter than it is at rest, and no cell is sheared.
TEST(LatticeSheet, HangsUnstrained) {
  LatticeSheet sheet({});
  sheet.hang_unstrained({-0.12, 0, 1}, {0.12, 0.01, 1}, {0, 1, 0});
  const LatticeEnergy e = sheet.energy();
  EXPECT_LT(e.stretch + e.shear, 0.05 * e.bend);  // chords are shorter than arcs
  EXPECT_NEAR((sheet.position().col(sheet.columns() - 1) - Eigen::Vector3d(0.12, 0.01, 1)).norm(), 0, 1e-9);
}

// The start of `hang` has the strained top edge fly off; creases of more than a right angle come and go.
TEST(LatticeSheet, SharpCreasesAreGoneThroughInPartsOfAStep) {
  FabricTruth truth;
  truth.density = 0.238;
  truth.stretch = 251;
  truth.shear = 153;
  LatticeSheet sheet(truth, {.cells_across = 22, .cells_down = 22});
  const Eigen::Vector3d left(-0.1205, 0, 0), right(0.1205, 0, 0);
  sheet.hang(left, right, {0, 1, 0});
  sheet.advance(0.4, left, right, 6);
  EXPECT_TRUE(sheet.position().allFinite());
}

}  // namespace
}  // namespace selvedge::hardware_sim
