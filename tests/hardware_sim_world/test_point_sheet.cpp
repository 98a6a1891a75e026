// The worlds of points: slopes, forces, meshes and effects.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "hardware_sim/bank/bank_campaign.h"
#include "hardware_sim/bank/worlds.h"
#include "hardware_sim/hidden_effects/hidden_effect.h"
#include "hardware_sim/sheets/point_sheet.h"

namespace selvedge::hardware_sim {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

FabricTruth soft_fabric() {
  FabricTruth t;
  t.density = 0.197;
  t.bend = 1.5e-5;
  t.bend_damping = 1.1e-7;
  return t;
}

class BothKinds : public testing::TestWithParam<PointKind> {
 protected:
  static PointLine line(int cells) {
    const std::vector<double> ends = graded_places(0.3, cells, 0.4, true);
    return GetParam() == PointKind::sliding ? sliding_line(ends) : element_line(ends);
  }
};

TEST_P(BothKinds, PolynomialsOfFifthDegreeAreExact) {
  const PointLine l = line(8);
  const auto f = [](double x, int d) {
    const double p[3] = {std::pow(10 * x, 5) - 3 * x, 50 * std::pow(10 * x, 4) - 3, 2000 * std::pow(10 * x, 3)};
    return p[d];
  };
  for (int p = 0; p < l.points(); ++p)
    for (int d = 0; d < 3; ++d) {
      const LineRows& rows = d == 0 ? l.value : d == 1 ? l.slope : l.second;
      double sum = 0;
      for (int k = 0; k < rows.reach; ++k)
        sum += static_cast<double>(rows.weight[static_cast<size_t>(p * rows.reach + k)]) *
               f(l.node[static_cast<size_t>(rows.first[static_cast<size_t>(p)] + k)], 0);
      EXPECT_NEAR(sum, f(l.point[static_cast<size_t>(p)], d), 2e-4 * std::pow(100, d) * 243) << p << " " << d;
    }
  double length = 0;
  for (const double w : l.node_weight) {
    EXPECT_GT(w, 0);
    length += w;
  }
  EXPECT_NEAR(length, 0.3, 1e-7);
  for (int i = 0; i < l.nodes(); ++i) {
    double sum = 0;
    for (int k = 0; k < l.node_slope.reach; ++k)
      sum += static_cast<double>(l.node_slope.weight[static_cast<size_t>(i * l.node_slope.reach + k)]) *
             f(l.node[static_cast<size_t>(l.node_slope.first[static_cast<size_t>(i)] + k)], 0);
    EXPECT_NEAR(sum, f(l.node[static_cast<size_t>(i)], 1), 2e-2 * 243) << i;
  }
}

// Along a direction that moves every node.
TEST_P(BothKinds, ForcesAreTheEnergysSlope) {
  SwatchOptions options;
  options.fineness = GetParam() == PointKind::sliding ? 0.4 : 0.5;
  FabricTruth truth = soft_fabric();
  truth.bend = 2e-3;
  PointSheet sheet(GetParam(), truth, options);
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 3e-4);
  Eigen::MatrixX3d here = sheet.position(), way(here.rows(), 3);
  for (Index i = 0; i < here.size(); ++i) here.data()[i] += normal(random);
  for (Index i = 0; i < way.size(); ++i) way.data()[i] = normal(random);
  sheet.set_position(here);
  const double slope = -(sheet.elastic_forces().array() * way.array()).sum(), step = 0.1;
  sheet.set_position(here + step * way);
  const double more = sheet.elastic_energy();
  sheet.set_position(here - step * way);
  EXPECT_NEAR((more - sheet.elastic_energy()) / (2 * step), slope, 3e-3 * std::abs(slope));
}

// A cylinder of radius 0.1 m: ½ B / R² per area, whatever the elements' kinks do.
TEST_P(BothKinds, ACylinderHasItsBendingEnergy) {
  FabricTruth truth = soft_fabric();
  truth.stretch = truth.shear = 1e-6;
  PointSheet sheet(GetParam(), truth, {});
  Eigen::MatrixX3d x = sheet.position();
  for (Index i = 0; i < x.rows(); ++i) {
    const double u = x(i, 0);
    x.row(i) << 0.1 * std::sin(u / 0.1), 0.1 * (1 - std::cos(u / 0.1)), x(i, 2);
  }
  sheet.set_position(x);
  EXPECT_NEAR(sheet.elastic_energy(), 0.5 * truth.bend / 0.01 * 0.09, 2e-3 * 0.5 * truth.bend / 0.01 * 0.09);
}

INSTANTIATE_TEST_SUITE_P(Points, BothKinds, testing::Values(PointKind::sliding, PointKind::elements),
                         [](const auto& info) { return info.param == PointKind::sliding ? "sliding" : "elements"; });

std::vector<Eigen::Vector2d> dots() {
  std::vector<Eigen::Vector2d> uv;
  for (int k = 0; k < 25; ++k) uv.emplace_back(0.3 * (0.1 + 0.2 * (k % 5)), 0.3 * (0.1 + 0.2 * (k / 5)));
  return uv;
}

double apart_mm(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return 1e3 * std::sqrt((a - b).colwise().squaredNorm().mean());
}

Eigen::Matrix3Xd after_a_swing(SwatchSheet& sheet, double apart) {
  const Vector3d left(-apart / 2, 0, 0), right(apart / 2, 0, 0);
  hang(sheet, HungCurve(left, right, {0, 1, 0}, {0, 0, -1}, soft_fabric().width_m));
  settle(sheet, left, right);
  for (int i = 1; i <= 40; ++i) sheet.advance(1.0 / 120, left, right + Vector3d(0, 0.03 * std::sin(0.06 * i), 0));
  return sheet.points(dots());
}

class AllWorlds : public testing::TestWithParam<BankWorld> {};

// Worlds of another form agree but for that form. How little their cells matter: `prove worlds`.
TEST_P(AllWorlds, SwingsNearlyAsTheLattice) {
  if (GetParam() == BankWorld::lattice) return;
  const auto a = make_swatch(GetParam(), soft_fabric(), {}, {}),
             b = make_swatch(BankWorld::lattice, soft_fabric(), {}, {});
  EXPECT_LT(apart_mm(after_a_swing(*a, 0.285), after_a_swing(*b, 0.285)), 1.5);
}

// A tenth of a second from where it was hung, on few cells: what does nothing would show.
Eigen::Matrix3Xd falls(BankWorld world, SwatchHold hold, const std::vector<std::pair<std::string, double>>& effects) {
  SwatchOptions options;
  options.hold = hold;
  options.fineness = 0.5;
  const auto sheet = make_swatch(world, soft_fabric(), options, effects);
  const double apart = hold == SwatchHold::corners ? 0.28 : 0.3;
  const Vector3d left(-apart / 2, 0, 0), right(apart / 2, 0, 0);
  hang(*sheet, HungCurve(left, right, {0, 1, 0}, {0, 0, -1}, soft_fabric().width_m));
  for (int i = 1; i <= 24; ++i)
    sheet->advance(1.0 / 120, left + Vector3d(0, 1e-3 * i, 0), right + Vector3d(0, 1e-3 * i, 0));
  std::vector<Eigen::Vector2d> uv = dots();
  for (const double u : {0.0, 0.075, 0.15, 0.3}) uv.emplace_back(u, 0);
  return sheet->points(uv);
}

TEST_P(AllWorlds, EveryEffectChangesAFall) {
  const Eigen::Matrix3Xd without = falls(GetParam(), SwatchHold::corners, {});
  std::vector<std::pair<std::string, double>> effects = {
      {"anisotropy", 0.8}, {"coupling", 0.4},        {"stretch_stiffening", 14}, {"bend_nonlinearity", 5e-6},
      {"hem", 2},          {"rest_curvature", 3e-5}, {"bend_friction", 2e-5},    {"stretch_friction", 0.5},
      {"creep", 1},        {"added_mass", 0.06},     {"local_mass", 6e-4}};
  for (const HiddenEffect& e : hidden_effects()) effects.emplace_back(e.name, 1);
  for (const auto& effect : effects) {
    const double moved_mm = apart_mm(falls(GetParam(), SwatchHold::corners, {effect}), without);
    EXPECT_GT(moved_mm, 5e-3) << effect.first;  // far above the rounding of floats
    EXPECT_LT(moved_mm, 30) << effect.first;
  }
}

TEST_P(AllWorlds, AHeldEdgeGoesStraightWhereItsCornersGo) {
  const Eigen::Matrix3Xd seen = falls(GetParam(), SwatchHold::top_edge, {});
  for (Index k = 25; k < 29; ++k) {
    EXPECT_NEAR(seen(1, k), 0.024, 1e-5) << k;
    EXPECT_NEAR(seen(2, k), 0, 1e-5) << k;
  }
  EXPECT_NEAR(seen(0, 25), -0.15, 1e-5);
  EXPECT_NEAR(seen(0, 28), 0.15, 1e-5);
}

INSTANTIATE_TEST_SUITE_P(Bank, AllWorlds, testing::Values(BankWorld::lattice, BankWorld::sliding, BankWorld::elements),
                         [](const auto& info) { return std::string(to_text(info.param)); });

}  // namespace
}  // namespace selvedge::hardware_sim
