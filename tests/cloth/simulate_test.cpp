// Lanes, integrators and rest.
#include <cmath>

#include <gtest/gtest.h>

#include "cli/verify/proofs/cloth_cases.h"

namespace selvedge::cloth {
namespace {

Experiment waving(const Sheet& sheet, int frames) {
  Experiment e = cli::waving_experiment(0.1, frames);
  e.start_shape = hung_shape(sheet, e, 1);
  return e;
}

Sheet grid(int n, Sides sides = Sides::straight) { return make_sheet(geometry::make_grid_mesh(0.3, 0.3, n, n), sides); }

class Lanes : public testing::TestWithParam<Sides> {};

TEST_P(Lanes, GiveTheBitsOfSingleRuns) {
  const Sheet sheet = grid(9, GetParam());
  std::vector<Experiment> lanes(7, waving(sheet, 6));
  for (size_t i = 0; i < lanes.size(); ++i) lanes[i].material.stretch *= 1 + 0.07 * static_cast<double>(i);
  lanes[1].material.bend_friction = 1e-4;   // another way of bending than its neighbours'
  lanes[2].material.stretch_damping = 0.4;  // more stages of damping
  lanes[3].material.coupling = 0.2;
  lanes[4].material.added_mass = 0.01;
  lanes[5].material.creep = 0.1;
  Options options;
  options.step_s = common_step_s(sheet, lanes);
  const std::vector<Trajectory> together = simulate(sheet, lanes, options);
  for (size_t i = 0; i < lanes.size(); ++i) {
    const Trajectory alone = simulate(sheet, {lanes[i]}, options)[0];
    ASSERT_TRUE(alone.finite) << "lane " << i;
    EXPECT_EQ(alone.start, together[i].start) << "lane " << i;
    EXPECT_EQ(alone.samples.back(), together[i].samples.back()) << "lane " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Sides, Lanes, testing::Values(Sides::straight, Sides::arcs));

TEST(Leapfrog, AgreesWithRungeKutta) {
  const Sheet sheet = grid(9);
  Experiment e = waving(sheet, 10);
  e.start_shape = relax(sheet, {e})[0].position;
  e.starts_at_rest = false;
  Options reference;
  reference.integrator = Options::Integrator::runge_kutta_45;
  const Eigen::Matrix3Xd exact = simulate(sheet, {e}, reference)[0].samples.back();
  const Eigen::Matrix3Xd own = simulate(sheet, {e})[0].samples.back();
  EXPECT_LT((own - exact).colwise().norm().maxCoeff(), 2e-4);
  Options finer;
  finer.step_s = common_step_s(sheet, {e}) / 8;
  EXPECT_LT((simulate(sheet, {e}, finer)[0].samples.back() - exact).colwise().norm().maxCoeff(), 4e-5);
}

TEST(Leapfrog, StagesOfDampingDoNotChangeTheMotion) {
  const Sheet sheet = grid(13);
  Experiment e = waving(sheet, 10);
  e.material.stretch_damping = e.material.shear_damping = 0.3;
  e.start_shape = relax(sheet, {e})[0].position;
  e.starts_at_rest = false;
  Options fine;
  fine.step_s = 1.5e-5;  // damping lagged in one stage
  const Eigen::Matrix3Xd lagged = simulate(sheet, {e}, fine)[0].samples.back();
  const Trajectory staged = simulate(sheet, {e})[0];
  ASSERT_TRUE(staged.finite);
  EXPECT_GT(common_step_s(sheet, {e}), 10 * fine.step_s);
  EXPECT_LT((staged.samples.back() - lagged).colwise().norm().maxCoeff(), 3e-4);
}

TEST(ImplicitEuler, ComesToTheSameMotionInShortSteps) {
  const Sheet sheet = grid(9);
  Experiment e = waving(sheet, 6);
  e.start_shape = relax(sheet, {e})[0].position;
  e.starts_at_rest = false;
  const Eigen::Matrix3Xd exact = simulate(sheet, {e})[0].samples.back();
  const auto off_m = [&](double step_s) {
    Options options;
    options.integrator = Options::Integrator::implicit_euler;
    options.step_s = step_s;
    return (simulate(sheet, {e}, options)[0].samples.back() - exact).colwise().norm().maxCoeff();
  };
  const double coarse = off_m(1.0 / 480), fine = off_m(1.0 / 1920);
  EXPECT_LT(fine, 2e-3);
  EXPECT_NEAR(coarse / fine, 4, 1.2);  // first order
}

TEST(ImplicitEuler, LosesTheEnergyThatLeapfrogKeeps) {
  EXPECT_LT(cli::energy_kept(9, 1, Options::Integrator::implicit_euler, 1.0 / 120), 0.7);
  EXPECT_GT(cli::energy_kept(9, 1, Options::Integrator::leapfrog), 0.995);
}

TEST(Relax, EndsWhereNothingMoves) {
  const Sheet sheet = grid(13);
  Experiment e = waving(sheet, 30);
  for (const double side : {1.0, -1.0}) {
    e.start_shape = hung_shape(sheet, e, side);
    const Rest rest = relax(sheet, {e})[0];
    ASSERT_TRUE(rest.at_rest);
    Experiment still = e;
    still.path.time_s.clear();
    still.path = make_path(Hold::corners, {0.0}, e.path.left.leftCols(1), e.path.right.leftCols(1));
    still.start_shape = rest.position;
    still.starts_at_rest = false;
    const Eigen::Matrix3Xd later = simulate(sheet, {still})[0].samples.back();
    EXPECT_LT((later - rest.position).colwise().norm().maxCoeff(), 2e-5);
  }
}

// A sheet that was hung long ago has crept to the end, and friction holds part of its weight: neither sets it in
// motion.
TEST(Relax, EndsWhereFrictionAndCreepHold) {
  const Sheet sheet = grid(13);
  Experiment e = waving(sheet, 30);
  e.path = make_path(Hold::corners, {0.0}, Eigen::Matrix3Xd(e.path.left.leftCols(1)),
                     Eigen::Matrix3Xd(e.path.right.leftCols(1)));
  const Eigen::Matrix3Xd plain = relax(sheet, {e})[0].position;
  Experiment rubbing = e, creeping = e;
  rubbing.material.bend_friction = 1e-4;
  rubbing.material.bend_friction_curvature = 15;
  creeping.material.creep = 1;
  for (Experiment* each : {&rubbing, &creeping}) {
    const Rest rest = relax(sheet, {*each})[0];
    ASSERT_TRUE(rest.at_rest);
    each->start_shape = rest.position;
    each->starts_at_rest = false;
    const Eigen::Matrix3Xd later = simulate(sheet, {*each})[0].samples.back();
    EXPECT_LT((later - rest.position).colwise().norm().maxCoeff(), 3e-5);
    Options reference;
    reference.integrator = Options::Integrator::runge_kutta_45;
    const Eigen::Matrix3Xd by_reference = simulate(sheet, {*each}, reference)[0].samples.back();
    EXPECT_LT((by_reference - rest.position).colwise().norm().maxCoeff(), 3e-5);
  }
  EXPECT_GT((rubbing.start_shape - plain).colwise().norm().maxCoeff(), 1e-4);
  EXPECT_LT((creeping.start_shape - plain).colwise().norm().maxCoeff(), 2e-5);
}

TEST(Relax, KeepsTheBranchItStartsOn) {
  const Sheet sheet = grid(13);
  Experiment e = waving(sheet, 1);
  e.start_shape = hung_shape(sheet, e, 1);
  const Eigen::Matrix3Xd one = relax(sheet, {e})[0].position;
  e.start_shape = hung_shape(sheet, e, -1);
  Eigen::Matrix3Xd other = relax(sheet, {e})[0].position;
  EXPECT_GT((one - other).colwise().norm().maxCoeff(), 0.02);
  other.row(1) *= -1;
  EXPECT_LT((one - other).colwise().norm().maxCoeff(), 2e-4);
}

TEST(Simulate, RefusesLanesThatDiffer) {
  const Sheet sheet = grid(9);
  std::vector<Experiment> lanes(2, waving(sheet, 3));
  lanes[1].sample_s.pop_back();
  EXPECT_THROW(simulate(sheet, lanes), std::invalid_argument);
}

}  // namespace
}  // namespace selvedge::cloth
