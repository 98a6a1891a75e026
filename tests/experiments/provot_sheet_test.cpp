#include "experiments/provot_sheet.h"

#include <cmath>

#include <gtest/gtest.h>

namespace selvedge::experiments {
namespace {

ProvotScene alone(int columns, int rows) {
  ProvotScene s;
  s.columns = columns;
  s.rows = rows;
  s.gravity_m_s2.setZero();
  s.damping_kg_s = 0;
  s.held = {0};
  return s;
}

double worst_elongation(const ProvotSheet& sheet, const ProvotFabric& fabric, const cloth::State& state) {
  double worst = 0;
  for (const ProvotSheet::Spring& s : sheet.springs())
    worst = std::max(worst, (state.position.col(s.second) - state.position.col(s.first)).norm() /
                                    fabric[static_cast<size_t>(s.kind)].length_m -
                                1);
  return worst;
}

TEST(ProvotSheet, HasThePapersSprings) {
  const ProvotSheet sheet(ProvotScene{});
  int count[6] = {};
  for (const ProvotSheet::Spring& s : sheet.springs()) ++count[s.kind];
  EXPECT_EQ(count[0], 17 * 16);
  EXPECT_EQ(count[1], 17 * 16);
  EXPECT_EQ(count[2], 16 * 16);
  EXPECT_EQ(count[3], 16 * 16);
  EXPECT_EQ(count[4], 17 * 15);
  EXPECT_EQ(count[5], 17 * 15);
}

TEST(ProvotSheet, SpringsMoveAndTurnNothing) {
  const ProvotScene scene = alone(6, 5);
  cloth::State state = level_start(scene);
  for (Eigen::Index i = 0; i < state.position.size(); ++i)
    state.position(i) += 0.01 * std::sin(7.0 * static_cast<double>(i));
  const Eigen::Matrix3Xd f = ProvotSheet(scene).forces(fabric_of({}), state);
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < f.cols(); ++i) {
    const Eigen::Vector3d arm = state.position.col(i), pull = f.col(i);
    torque += Eigen::Vector3d(arm.y() * pull.z() - arm.z() * pull.y(), arm.z() * pull.x() - arm.x() * pull.z(),
                              arm.x() * pull.y() - arm.y() * pull.x());
  }
  EXPECT_GT(f.norm(), 0.01);
  EXPECT_LT(f.rowwise().sum().norm(), 1e-12);
  EXPECT_LT(torque.norm(), 1e-12);
}

TEST(ProvotSheet, ShortensASuperElongatedSpringToItsCriticalRate) {
  // A strip of two points, two structural springs in the middle of nothing: pull one apart.
  ProvotScene scene = alone(2, 2);
  ProvotFabric fabric = fabric_of({});
  for (size_t k = 1; k < 6; ++k) fabric[k] = {10, 0, 0.1};  // too long to bind
  const ProvotSheet sheet(scene);
  cloth::State state = level_start(scene);
  state.position.col(1).x() = 0.3;  // held point 0 at the origin
  state.position.col(3).x() = 0.3;
  sheet.advance(fabric, state);
  const double longest = 1.5 * fabric[0].length_m;
  EXPECT_NEAR((state.position.col(1) - state.position.col(0)).norm(), longest, 1e-12);
  EXPECT_NEAR((state.position.col(3) - state.position.col(2)).norm(), longest, 1e-12);
  EXPECT_EQ(state.position.col(0).norm(), 0);
  EXPECT_GT(state.position(0, 2), 0.01);  // both free ends came closer
}

TEST(ProvotSheet, HangsWithManySpringsAtTheirCriticalRate) {
  const ProvotScene scene;
  const ProvotSheet sheet(scene);
  const ProvotFabric fabric = fabric_of({});
  const cloth::State end = sheet.run(fabric, level_start(scene), 1500).back();
  ASSERT_TRUE(end.position.allFinite());
  EXPECT_LT(end.velocity.colwise().norm().maxCoeff(), 0.1);
  ProvotFabric elastic = fabric;
  for (SpringKind& kind : elastic) kind.critical_elongation = 1e9;
  const double corrected = worst_elongation(sheet, fabric, end);
  const double plain = worst_elongation(sheet, elastic, sheet.run(elastic, level_start(scene), 1500).back());
  EXPECT_GT(plain, 0.8);
  EXPECT_LT(corrected, 0.65);
}

TEST(ProvotSheet, IsCarriedByTheFlow) {
  ProvotScene scene = alone(4, 4);
  scene.flow_kg_s = 0.05;
  scene.flow_m_s = {0.3, 0, 0.7};
  scene.held = {};
  cloth::State state = level_start(scene);
  const Eigen::Matrix3Xd f =
      ProvotSheet(scene).forces(fabric_of({}), state) - ProvotSheet(alone(4, 4)).forces(fabric_of({}), state);
  for (Eigen::Index i = 0; i < f.cols(); ++i) EXPECT_LT((f.col(i) - Eigen::Vector3d(0, 0, 0.05 * 0.7)).norm(), 1e-15);
}

TEST(ProvotSheet, FallsAtTheSpeedThatViscousDampingSets) {
  ProvotScene scene;
  scene.held = {0};
  scene.columns = scene.rows = 2;
  ProvotFabric loose = fabric_of({});
  for (SpringKind& kind : loose) kind = {1, 0, 1e9};
  const cloth::State end = ProvotSheet(scene).run(loose, level_start(scene), 4000).back();
  EXPECT_NEAR(end.velocity(2, 3), -scene.mass_kg * 9.81 / scene.damping_kg_s, 1e-9);
}

}  // namespace
}  // namespace selvedge::experiments
