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
    const std::vector<double> ends = graded_ends(0.3, cells, 0.4, true);
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
  sheet.hang(left, right, {0, 1, 0});
  settle(sheet, left, right);
  for (int i = 1; i <= 40; ++i) sheet.advance(1.0 / 120, left, right + Vector3d(0, 0.03 * std::sin(0.06 * i), 0));
  return sheet.points(dots());
}

class AllWorlds : public testing::TestWithParam<BankWorld> {};

TEST_P(AllWorlds, FinerCellsHardlyMoveASwing) {
  SwatchOptions usual, finer;
  finer.fineness = 1.3;
  for (const SwatchHold hold : {SwatchHold::corners, SwatchHold::top_edge}) {
    usual.hold = finer.hold = hold;
    const double apart = hold == SwatchHold::corners ? 0.285 : 0.3;
    const auto a = make_swatch(GetParam(), soft_fabric(), usual, {}),
               b = make_swatch(GetParam(), soft_fabric(), finer, {});
    EXPECT_LT(apart_mm(after_a_swing(*a, apart), after_a_swing(*b, apart)), 0.25);
  }
}

// Worlds of another form agree but for that form.
TEST_P(AllWorlds, SwingsNearlyAsTheLattice) {
  const auto a = make_swatch(GetParam(), soft_fabric(), {}, {}),
             b = make_swatch(BankWorld::lattice, soft_fabric(), {}, {});
  EXPECT_LT(apart_mm(after_a_swing(*a, 0.285), after_a_swing(*b, 0.285)), 1.2);
}

TEST_P(AllWorlds, EveryEffectChangesASwing) {
  const FabricTruth truth = soft_fabric();
  const auto plain = make_swatch(GetParam(), truth, {}, {});
  const Eigen::Matrix3Xd without = after_a_swing(*plain, 0.285);
  std::vector<std::pair<std::string, double>> effects = {
      {"anisotropy", 0.8}, {"coupling", 0.4},        {"stretch_stiffening", 14}, {"bend_nonlinearity", 5e-6},
      {"hem", 2},          {"rest_curvature", 3e-5}, {"bend_friction", 2e-5},    {"stretch_friction", 0.5},
      {"creep", 1},        {"added_mass", 0.06},     {"local_mass", 6e-4}};
  for (const HiddenEffect& e : hidden_effects()) effects.emplace_back(e.name, 1);
  for (const auto& effect : effects) {
    const auto sheet = make_swatch(GetParam(), truth, {}, {effect});
    const Eigen::Matrix3Xd with = after_a_swing(*sheet, 0.285);
    ASSERT_TRUE(with.allFinite()) << effect.first;
    EXPECT_GT(apart_mm(with, without), 0.05) << effect.first;
    EXPECT_LT(apart_mm(with, without), 60) << effect.first;
    std::printf("%s %s %.3f\n", to_text(GetParam()), effect.first.c_str(), apart_mm(with, without));
  }
}

INSTANTIATE_TEST_SUITE_P(Bank, AllWorlds, testing::Values(BankWorld::lattice, BankWorld::sliding, BankWorld::elements),
                         [](const auto& info) { return std::string(to_text(info.param)); });

}  // namespace
}  // namespace selvedge::hardware_sim
