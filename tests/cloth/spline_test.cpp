// The spline sheet against the triangles, against closed forms and differences, and its lanes against one another.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "cloth/kernel/force_field.h"
#include "cloth/kernel/processor.h"
#include "cloth/spline/banded_solver.h"
#include "cloth/spline/chosen_grid.h"
#include "cloth/spline/derivatives.h"
#include "cloth/spline/energy.h"
#include "cloth/spline/kernel/tables.h"
#include "cloth/spline/lane_run.h"
#include "cloth/spline/settle.h"
#include "cloth/spline/simulate.h"
#include "cloth/spline/spectrum.h"
#include "cloth/spline/tangent.h"

namespace selvedge::cloth::spline {
namespace {

SplineSheet sheet_of(int cells, Hold hold = Hold::corners, const Swatch& swatch = {}) {
  return make_spline_sheet(swatch, make_grid(swatch, hold, swatch.width_m / cells));
}

// Corners 0.255 m apart, the right one moved sideways.
Experiment waved(Hold hold = Hold::corners) {
  Experiment e;
  std::vector<double> time_s;
  Eigen::Matrix3Xd left(3, 40), right(3, 40);
  for (Eigen::Index i = 0; i < 40; ++i) {
    time_s.push_back(0.01 * static_cast<double>(i));
    const double away = 0.03 * (1 - std::cos(2 * M_PI * 1.5 * time_s.back()));
    left.col(i) << -0.1275, 0, 0;
    right.col(i) << 0.1275, away, 0;
  }
  e.path = make_path(hold, time_s, left, right);
  for (int k = 0; k <= 10; ++k) e.sample_s.push_back(0.02 * k);
  return e;
}

Material every_effect_with_an_energy() {
  Material m;
  m.stretch_damping = m.shear_damping = m.bend_damping = m.drag_normal = m.drag_tangent = 0;
  m.stretch_anisotropy = 0.3;
  m.coupling = 0.2;
  m.stretch_stiffening = 3;
  m.bend = 1e-3;
  m.bend_stiffening = 1e-4;
  m.hem_stiffness = 2;
  return m;
}

Eigen::Matrix3Xd crumpled(const SplineSheet& sheet) {
  Eigen::Index next = 0;
  return control_points_through(sheet, [&](const Eigen::Vector2d& uv) -> Eigen::Vector3d {
    const double rough = 1e-3 * std::sin(12.9898 * static_cast<double>(++next));
    return {1.03 * uv.x() + rough, 0.97 * uv.y() + 0.1 * uv.x(), 0.3 * uv.x() * uv.x() - 0.2 * uv.x() * uv.y() - rough};
  });
}

TEST(SplineBasis, SumsToOneAndFollowsItsSlopes) {
  const Basis basis({0, 0.01, 0.03, 0.07, 0.11, 0.2});
  for (double x = 0.001; x < 0.2; x += 0.0063) {
    const Alive here = basis.at(x), there = basis.at(x + 1e-7);
    double sum = 0, linear = 0;
    for (size_t k = 0; k < 4; ++k) {
      sum += here.of[0][k];
      linear += here.of[0][k] * basis.greville(here.first + static_cast<int>(k));
      if (here.first != there.first) continue;
      for (size_t d = 0; d < 3; ++d)
        EXPECT_NEAR((there.of[d][k] - here.of[d][k]) / 1e-7, here.of[d + 1][k], 1e-4 * std::pow(100, d + 1));
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_NEAR(linear, x, 1e-12);
  }
  EXPECT_THROW(Basis({0, 0.1, 0.1, 0.2, 0.3}), std::invalid_argument);
}

class SplineForces : public testing::TestWithParam<double> {
 protected:
  Material material() const {
    Material m = every_effect_with_an_energy();
    m.stretch_stiffening = GetParam();
    return m;
  }
};
INSTANTIATE_TEST_SUITE_P(Stiffening, SplineForces, testing::Values(3, -1.5));

TEST_P(SplineForces, AreTheEnergysGradient) {
  const SplineSheet sheet = sheet_of(5);
  Experiment e = waved();
  e.material = material();
  Eigen::Matrix3Xd x = crumpled(sheet);
  const Eigen::Matrix3Xd still = Eigen::Matrix3Xd::Zero(3, x.cols());
  LaneRun<double> run(sheet, {&e});
  run.set_position(0, x);
  run.set_forces(0);
  const Eigen::Matrix3Xd force = run.force(0);
  const auto energy = [&] { return energy_of(sheet, e.material, Eigen::Vector3d::Zero(), x, still).potential(); };
  const auto slope = [&](Eigen::Index k, double h) {
    const double at = x(k);
    x(k) = at + h;
    const double up = energy();
    x(k) = at - h;
    const double down = energy();
    x(k) = at;
    return (up - down) / (2 * h);
  };
  for (Eigen::Index k = 0; k < x.size(); k += 5)
    EXPECT_NEAR(force(k), -(4 * slope(k, 1e-5) - slope(k, 2e-5)) / 3, 1e-6 * force.cwiseAbs().maxCoeff()) << k;
}

TEST_P(SplineForces, AreWhatTheTangentSays) {
  const SplineSheet sheet = sheet_of(5);
  Experiment e = waved();
  e.material = material();
  e.material.hem_stiffness = 2;
  const Eigen::Matrix3Xd x = crumpled(sheet);
  Tangent tangent(sheet);
  tangent.set(e.material, x, Convexity::as_it_is);
  Eigen::VectorXd moved(x.size());
  for (Eigen::Index i = 0; i < moved.size(); ++i) moved(i) = std::sin(78.233 * static_cast<double>(i + 1));
  const auto force_at = [&](double share) {
    LaneRun<double> run(sheet, {&e});
    run.set_position(0, x + share * moved.reshaped(3, x.cols()));
    run.set_forces(0);
    return Eigen::VectorXd(run.force(0).reshaped());
  };
  const Eigen::VectorXd change = (force_at(1e-7) - force_at(-1e-7)) / 2e-7;
  const Eigen::VectorXd told = -(tangent.matrix() * moved);
  EXPECT_LT((change - told).norm(), 1e-5 * told.norm());
}

// Waved from a hung shape that is no equilibrium.
Experiment waved_from_hung(const SplineSheet& sheet) {
  Experiment e = waved();
  e.starts_at_rest = false;
  e.start_shape = hung_shape(sheet, e, 1);
  return e;
}

// In whichever company, and in vectors of whatever width.
TEST(SplineLanes, HaveTheBitsOfASingleRun) {
  const SplineSheet sheet = sheet_of(9);
  Experiment e = waved_from_hung(sheet);
  e.material.bend = 2e-5;
  std::vector<Experiment> lanes(40, e);
  for (size_t i = 0; i < lanes.size(); ++i) lanes[i].material.bend *= 1 + 0.01 * static_cast<double>(i);
  for (const Precision precision : {Precision::single, Precision::twofold}) {
    Options options;
    options.precision = precision;
    options.step_s = common_step_s(sheet, lanes);
    const auto first = simulate(sheet, {lanes[0]}, options);
    EXPECT_TRUE(first[0].finite);
    for (const std::ptrdiff_t count : {3, 7, 11, 40}) {
      const std::vector<Experiment> some(lanes.begin(), lanes.begin() + count);
      const auto together = simulate(sheet, some, options), last = simulate(sheet, {some.back()}, options);
      EXPECT_TRUE(last[0].finite);
      for (size_t k = 0; k < e.sample_s.size(); ++k) {
        EXPECT_EQ(together.front().samples[k], first[0].samples[k]) << count;
        EXPECT_EQ(together.back().samples[k], last[0].samples[k]) << count;
      }
    }
  }
}

// A search may ask for fabric so stiff that one lane would take longer than all others.
TEST(SplineLanes, ThatAskForShorterStepsThanAllowedAreNotRun) {
  const SplineSheet sheet = sheet_of(8);
  const Experiment usual = waved_from_hung(sheet);
  Experiment absurd = usual;
  absurd.material.stretch *= 1e4;
  Options options;
  options.shortest_step_s = common_step_s(sheet, {usual}) / 10;
  ASSERT_LT(common_step_s(sheet, {absurd}), options.shortest_step_s);
  EXPECT_EQ(common_step_s(sheet, {usual, absurd}, options), common_step_s(sheet, {usual}));
  const auto together = simulate(sheet, {absurd, usual, absurd}, options), alone = simulate(sheet, {usual}, options);
  for (const size_t i : {size_t{0}, size_t{2}}) {
    EXPECT_FALSE(together[i].finite);
    ASSERT_EQ(together[i].samples.size(), absurd.sample_s.size());
    for (const Eigen::Matrix3Xd& x : together[i].samples) EXPECT_TRUE(x.array().isNaN().all());
  }
  EXPECT_TRUE(together[1].finite);
  EXPECT_EQ(together[1].samples, alone[0].samples);
}

// Trials of one fabric begin and end when they like.
TEST(SplineLanes, MayBeginAndEndAtTimesOfTheirOwn) {
  const SplineSheet sheet = sheet_of(8);
  const Experiment long_one = waved_from_hung(sheet);
  Experiment short_one = long_one;
  short_one.start_s = 0.05;
  short_one.sample_s = {0.05, 0.0815, 0.11};
  Options options;
  options.step_s = common_step_s(sheet, {long_one});
  const auto together = simulate(sheet, {short_one, long_one}, options);
  const Trajectory alone[] = {simulate(sheet, {short_one}, options)[0], simulate(sheet, {long_one}, options)[0]};
  for (size_t i = 0; i < 2; ++i) {
    ASSERT_EQ(together[i].samples.size(), alone[i].samples.size());
    for (size_t k = 0; k < alone[i].samples.size(); ++k) EXPECT_EQ(together[i].samples[k], alone[i].samples[k]) << i;
  }
  EXPECT_EQ(alone[0].samples[0], short_one.start_shape);
  EXPECT_NE(alone[0].samples[2], alone[1].samples[2]);
}

// A motion goes on from where and how fast another ended, beside one that begins at rest.
TEST(SplineLanes, GoOnFromAMotionBesideOneAtRest) {
  const SplineSheet sheet = sheet_of(8);
  Experiment whole = waved();
  whole.material = Material();
  whole.start_shape = hung_shape(sheet, whole, 1);
  Options options;
  options.precision = Precision::twofold;
  options.step_s = common_step_s(sheet, {whole}) / 4;
  const Trajectory through = simulate(sheet, {whole}, options)[0];
  Experiment first = whole, second = whole;
  first.sample_s.assign(whole.sample_s.begin(), whole.sample_s.begin() + 6);
  const Trajectory ended = simulate(sheet, {first}, options)[0];
  second.start_s = first.sample_s.back();
  second.sample_s.assign(whole.sample_s.begin() + 5, whole.sample_s.end());
  second.starts_at_rest = false;
  second.start_shape = ended.samples.back();
  second.start_velocity = ended.end_velocity;
  const std::vector<Trajectory> both = simulate(sheet, {second, first}, options);
  const Eigen::Matrix3Xd &end = through.samples.back(), &begin = through.samples[5];
  EXPECT_LT((both[0].samples.back() - end).cwiseAbs().maxCoeff(), 2e-5);
  EXPECT_GT((begin - end).cwiseAbs().maxCoeff(), 5e-3);
  EXPECT_EQ(both[1].samples.back(), ended.samples.back());
  second.start_velocity = {};
  EXPECT_GT((simulate(sheet, {second}, options)[0].samples.back() - end).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(SplineLanes, AreAlikeOnEachKindOfProcessorAndInEachPrecision) {
  const SplineSheet sheet = sheet_of(9);
  Experiment e = waved();
  e.material.bend = 2e-5;
  e.start_shape = settle(sheet, e, hung_shape(sheet, e, 1), 2e-6).position;
  e.starts_at_rest = false;
  Options twofold;
  twofold.precision = Precision::twofold;
  const Trajectory exact = simulate(sheet, {e}, twofold)[0];
  const std::string best = cloth::kernel::processor_kind();
  for (const char* kind : {"plain", "avx2", "avx512"}) {
    if (!cloth::kernel::use_processor_kind(kind)) continue;
    const Trajectory motion = simulate(sheet, {e})[0];
    for (size_t k = 0; k < e.sample_s.size(); ++k)
      EXPECT_LT((motion.samples[k] - exact.samples[k]).colwise().norm().maxCoeff(), 1e-5) << kind;
  }
  EXPECT_TRUE(cloth::kernel::use_processor_kind(best.c_str()));
}

// On square and oblong swatches, each right-hand side as it is alone.
TEST(SplineBandedSolver, SolvesOnEachKindOfProcessor) {
  const std::string best = cloth::kernel::processor_kind();
  for (const Swatch& swatch : {Swatch{0.2, 0.2}, Swatch{0.4, 0.2}, Swatch{0.2, 0.5}}) {
    const SplineSheet sheet = make_spline_sheet(swatch, make_grid(swatch, Hold::corners, 0.04));
    Tangent tangent(sheet);
    tangent.set(Material(), crumpled(sheet), Convexity::kept_positive);
    std::vector<char> is_held(3 * static_cast<size_t>(sheet.count()), 0);
    is_held[4] = 1;
    StiffnessMatrix matrix = tangent.matrix();
    for (Eigen::Index i = 0; i < matrix.rows(); ++i) matrix.coeffRef(i, i) += 0.1;
    hold_still(is_held, matrix);
    Eigen::MatrixXd right(matrix.rows(), 11);
    for (Eigen::Index i = 0; i < right.size(); ++i) right(i) = std::sin(12.9898 * static_cast<double>(i + 1));
    for (const char* kind : {"plain", "avx2", "avx512"}) {
      if (!cloth::kernel::use_processor_kind(kind)) continue;
      BandedSolver solver(sheet);
      ASSERT_TRUE(solver.factorise(tangent, Eigen::VectorXd::Constant(sheet.count(), 0.1), is_held)) << kind;
      const Eigen::MatrixXd x = solver.solve(right);
      EXPECT_LT((matrix * x - right).norm(), 1e-9 * right.norm()) << kind;
      EXPECT_EQ(solver.solve(right.col(9)), x.col(9)) << kind;
      EXPECT_FALSE(solver.factorise(tangent, Eigen::VectorXd::Constant(sheet.count(), -1e3), is_held)) << kind;
    }
  }
  EXPECT_TRUE(cloth::kernel::use_processor_kind(best.c_str()));
}

// As fits seek it: one step or few, from the equilibrium of a fabric that is a little different.
TEST(SplineSettle, TakesFewStepsFromNear) {
  const SplineSheet sheet = sheet_of(14);
  Experiment e = waved();
  e.material.bend_stiffening = -1e-5;
  const Eigen::Matrix3Xd start = settle(sheet, e, hung_shape(sheet, e, 1), 2e-6).position;
  e.material.bend *= 1.01;
  const Settled near = settle(sheet, e, start, 2e-6);
  EXPECT_TRUE(near.at_rest);
  EXPECT_LE(near.steps, 6);
  const Settled closer = settle(sheet, e, near.position, 1e-8);
  EXPECT_LE(closer.steps, 2);
  EXPECT_LT((closer.position - near.position).colwise().norm().maxCoeff(), 2e-7);
  EXPECT_GT((near.position - start).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(SplineSettle, FindsTheEquilibriumOfTheTriangles) {
  const SplineSheet sheet = sheet_of(14);
  Experiment e = waved();
  const Settled rest = settle(sheet, e, hung_shape(sheet, e, 1), 2e-6);
  ASSERT_TRUE(rest.at_rest);
  const Sheet triangles = make_sheet(geometry::make_grid_mesh(0.3, 0.3, 33, 33), Sides::arcs);
  e.start_shape = cloth::hung_shape(triangles, e, 1);
  const Eigen::Matrix3Xd other = relax(triangles, {e})[0].position;
  double sum = 0;
  for (int k = 0; k < 25; ++k) {
    const Eigen::Vector2d uv(0.015 + 0.0675 * (k % 5), 0.015 + 0.0675 * (k / 5));
    sum +=
        (position_of(surface_point(sheet, uv), rest.position) - position_of(cloth::surface_point(triangles, uv), other))
            .squaredNorm();
  }
  EXPECT_LT(std::sqrt(sum / 25), 1e-3);
}

TEST(SplineHold, KeepsWhatTheRigHolds) {
  for (const Hold hold : {Hold::corners, Hold::top_edge, Hold::top_edge_clamped, Hold::side_edges}) {
    const SplineSheet sheet = sheet_of(8, hold);
    Experiment e = waved(hold);
    e.material.bend = 1e-4;
    e.start_shape = hung_shape(sheet, e, 1);
    if (hold == Hold::side_edges) e.path.clamp_direction = {0, 0, -1};
    const Trajectory t = simulate(sheet, {e})[0];
    ASSERT_TRUE(t.finite);
    for (const Grip& grip : grips_of(sheet, hold))
      for (size_t k = 1; k < e.sample_s.size(); ++k) {
        Eigen::Vector3d reads = Eigen::Vector3d::Zero();
        for (const Weight& w : grip.reads) reads += w.weight * t.samples[k].col(w.point);
        EXPECT_LT((reads - held_position(grip, e.path, e.path.at(e.sample_s[k]))).norm(), 2e-5);
      }
  }
}

// Of an undamped sheet that swings for a second.
double kept_energy(double added_mass) {
  const SplineSheet sheet = sheet_of(8);
  Experiment e = waved();
  e.material.added_mass = added_mass;
  e.material.stretch_damping = e.material.shear_damping = e.material.bend_damping = 0;
  e.material.drag_normal = e.material.drag_tangent = 0;
  e.path = make_path(Hold::corners, {0.0}, Eigen::Vector3d(-0.1275, 0, 0), Eigen::Vector3d(0.1275, 0, 0));
  const Eigen::Vector3d upright = e.gravity_m_s2;
  e.gravity_m_s2 = 9.81 * Eigen::Vector3d(0, std::sin(0.35), -std::cos(0.35));
  e.start_shape = settle(sheet, e, hung_shape(sheet, e, 1), 2e-6).position;
  e.gravity_m_s2 = upright;
  const Eigen::Matrix3Xd rest = settle(sheet, e, e.start_shape, 2e-6).position;
  e.starts_at_rest = false;
  Options options;
  options.precision = Precision::twofold;
  options.step_s = 0.3 * common_step_s(sheet, {e});
  const double last = std::round(1 / options.step_s);
  e.sample_s = {(last - 1) * options.step_s, last * options.step_s, (last + 1) * options.step_s};
  const Trajectory t = simulate(sheet, {e}, options)[0];
  const auto total = [&](const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& v) {
    return energy_of(sheet, e.material, upright, x, v).total();
  };
  const Eigen::Matrix3Xd still = Eigen::Matrix3Xd::Zero(3, rest.cols());
  const double at_rest = total(rest, still);
  const Eigen::Matrix3Xd velocity = (t.samples[2] - t.samples[0]) / (2 * options.step_s);
  return (total(t.samples[1], velocity) - at_rest) / (total(e.start_shape, still) - at_rest);
}

TEST(SplineEnergy, OfAnUndampedSheetStays) { EXPECT_NEAR(kept_energy(0), 1, 1e-3); }

// Air resists accelerations along normals that turn, so that its energy is not kept as exactly.
TEST(SplineEnergy, OfAnUndampedSheetWithAirStays) { EXPECT_NEAR(kept_energy(0.1), 1, 0.08); }

// A waved sheet beside itself at a quarter of the steps: root mean square, m; infinite where one diverges.
double off_from_quarter_steps_m(const SplineSheet& sheet, const Material& material) {
  Experiment e = waved();
  e.material = material;
  for (int k = 11; k <= 18; ++k) e.sample_s.push_back(0.02 * k);
  e.start_shape = settle(sheet, e, hung_shape(sheet, e, 1), 2e-6).position;
  e.starts_at_rest = false;
  Options quarter;
  quarter.step_s = 0.25 * common_step_s(sheet, {e});
  const Trajectory usual = simulate(sheet, {e})[0], fine = simulate(sheet, {e}, quarter)[0];
  if (!usual.finite || !fine.finite) return std::numeric_limits<double>::infinity();
  double squares = 0;
  for (size_t k = 0; k < usual.samples.size(); ++k) squares += (usual.samples[k] - fine.samples[k]).squaredNorm();
  return std::sqrt(squares / static_cast<double>(usual.samples.size()) / sheet.count());
}

// Damping of bending that is stiffer than a step is short neither diverges nor makes the motion depend on the step.
TEST(SplineSteps, AreShortEnoughWhateverBendingsDampingIs) {
  const SplineSheet sheet = sheet_of(20);
  Material m;
  m.bend = 1e-5;
  for (const double damping : {5e-8, 5e-7, 5e-6}) {
    m.bend_damping = damping;
    EXPECT_LT(off_from_quarter_steps_m(sheet, m), 5e-5) << damping;
  }
}

// Much damping of the membrane beside much of bending, on light fabric: at the step that each alone allows this
// motion was nearly 4 mm off.
TEST(SplineSteps, AreShortEnoughForBothDampingsTogether) {
  Material m;
  m.density = 0.0697, m.stretch = 75.2, m.shear = 69.4, m.bend = 7.3e-6;
  m.stretch_damping = 0.161, m.shear_damping = 0.14, m.bend_damping = 3.2e-6;
  EXPECT_LT(off_from_quarter_steps_m(sheet_of(10), m), 3e-4);
}

// Ten times the usual damping of the membrane: more than ten stages, for three times the step of six.
TEST(SplineSteps, OfManyStagesAreShortEnough) {
  const SplineSheet sheet = sheet_of(18);
  Material m;
  m.density = 0.074, m.stretch = 44.1, m.shear = 25.9, m.bend = 7.9e-6;
  m.stretch_damping = 0.41, m.shear_damping = 1.17, m.bend_damping = 3.7e-7;
  Spectrum spectrum = spectra_of(sheet, {m})[0];
  const StepPlan many = plan_step(spectrum);
  spectrum.most_stages = 6;
  EXPECT_GT(many.stages.count, 10);
  EXPECT_GT(many.step_s, 3 * plan_step(spectrum).step_s);
  EXPECT_LT(off_from_quarter_steps_m(sheet, m), 3e-4);
}

TEST(SplineDerivatives, AreThoseOfCentralDifferences) {
  const SplineSheet sheet = sheet_of(8);
  Experiment e = waved();
  e.start_shape = hung_shape(sheet, e, 1);
  Options options;
  options.precision = Precision::twofold;
  const double step = 0.005 * e.material.shear;
  const Derivatives d = derivatives(sheet, e, {{&Material::shear, step}, {&Material::drag_normal, 0.005}}, options);
  ASSERT_TRUE(d.finite);
  e.start_shape = d.motion.start;
  options.step_s = 0.9 * common_step_s(sheet, {e});
  std::vector<Experiment> sides(2, e);
  sides[0].material.shear -= step;
  sides[1].material.shear += step;
  const auto motion = simulate(sheet, sides, options);
  const Eigen::Matrix3Xd central = (motion[1].samples.back() - motion[0].samples.back()) / (2 * step);
  EXPECT_GT(central.norm(), 0);
  EXPECT_LT((d.by[0].back() - central).norm(), 0.05 * central.norm());
}

TEST(SplineGrid, BendingLengthFollowsTheFabric) {
  cloth::Material m;
  m.bend = 1e-4;
  const double stiff_m = bending_length_m(m);
  EXPECT_NEAR(stiff_m, std::cbrt(1e-4 / (0.16 * 9.81)), 1e-6);
  m.bend_stiffening = -1e-4;
  EXPECT_LT(bending_length_m(m), 0.99 * stiff_m);
  m.bend = 1e-5;
  EXPECT_LT(bending_length_m(m), stiff_m / 2);
}

TEST(SplineGrid, IsRefinedWhileTheNextFinerMovesTheFabric) {
  std::vector<int> asked;
  const auto moved_m = [&](int cells) {
    asked.push_back(cells);
    return 0.08 / (cells * cells);  // 0.8 mm on 10, 0.41 mm on 14
  };
  const ChosenGrid chosen = choose_grid(10, 64, moved_m);
  EXPECT_EQ(chosen.cells, 14);
  EXPECT_FALSE(chosen.leaves_open());
  EXPECT_EQ(asked, (std::vector<int>{10, 14}));
  const ChosenGrid cut = choose_grid(10, 13, moved_m);
  EXPECT_EQ(cut.cells, 10);
  EXPECT_TRUE(cut.leaves_open());
  EXPECT_FALSE(choose_grid(10, 64, [](int) { return std::nan(""); }).leaves_open());
}

TEST(SplineSheet, RefusesWhatItCannotDo) {
  const SplineSheet sheet = sheet_of(6);
  Experiment e = waved();
  e.start_shape = hung_shape(sheet, e, 1);
  e.starts_at_rest = false;
  e.make_step_filter = [] { return cloth::kernel::StepFilter(); };
  EXPECT_THROW(simulate(sheet, {e}), std::invalid_argument);
}

// Each member of Material alone, off its neutral value.
TEST(SplineEffects, AllMoveTheSheetAndStayFinite) {
  const SplineSheet sheet = sheet_of(9);
  Experiment e = waved();
  e.start_shape = settle(sheet, e, hung_shape(sheet, e, 1), 2e-6).position;
  e.starts_at_rest = false;
  e.sample_s = {0.05};
  const std::pair<double Material::*, double> off[] = {{&Material::density, 0.2},
                                                       {&Material::stretch, 150},
                                                       {&Material::shear, 60},
                                                       {&Material::bend, 5e-5},
                                                       {&Material::stretch_damping, 0.06},
                                                       {&Material::shear_damping, 0.06},
                                                       {&Material::bend_damping, 6e-7},
                                                       {&Material::drag_normal, 2},
                                                       {&Material::drag_tangent, 0.2},
                                                       {&Material::drag_fade, 20},
                                                       {&Material::drag_linear, 0.2},
                                                       {&Material::stretch_anisotropy, 0.4},
                                                       {&Material::bend_anisotropy, 0.4},
                                                       {&Material::coupling, 0.3},
                                                       {&Material::stretch_stiffening, 10},
                                                       {&Material::bend_stiffening, -1e-4},
                                                       {&Material::rest_curvature_u, 3},
                                                       {&Material::rest_curvature_v, 3},
                                                       {&Material::bend_friction, 1e-4},
                                                       {&Material::stretch_friction, 0.2},
                                                       {&Material::creep, 0.3},
                                                       {&Material::added_mass, 0.1},
                                                       {&Material::hem_stiffness, 2},
                                                       {&Material::hem_density, 0.1},
                                                       {&Material::local_mass_kg, 0.002}};
  std::vector<Experiment> lanes(std::size(off) + 1, e);
  for (size_t k = 0; k < std::size(off); ++k) lanes[k].material.*off[k].first = off[k].second;
  const auto motions = simulate(sheet, lanes);
  const Eigen::Matrix3Xd& plain = motions.back().samples[0];
  for (size_t k = 0; k < motions.size(); ++k) {
    EXPECT_TRUE(motions[k].finite && motions[k].samples[0].allFinite()) << k;
    if (k == std::size(off)) break;
    EXPECT_GT((motions[k].samples[0] - plain).cwiseAbs().maxCoeff(), 1e-7) << k;
  }
}

// What air carried along changes of a motion is on splines what it is on triangles.
TEST(SplineEffects, AddedMassIsThatOfTriangles) {
  const Sheet triangles = make_sheet(geometry::make_grid_mesh(0.3, 0.3, 33, 33), Sides::arcs);
  const SplineSheet sheet = sheet_of(14);
  Experiment e = waved();
  e.material.bend = 1e-4;
  e.sample_s = {0.3};
  const auto changes = [&](const auto& on, const Eigen::Matrix3Xd& start) {
    std::vector<Experiment> lanes(2, e);
    lanes[0].start_shape = lanes[1].start_shape = start;
    lanes[1].material.added_mass = 0.08;
    const auto motion = simulate(on, lanes);
    EXPECT_LT((motion[1].start - motion[0].start).cwiseAbs().maxCoeff(), 1e-4);
    Eigen::Matrix3Xd out(3, 25);
    for (int k = 0; k < 25; ++k) {
      const SurfacePoint at = surface_point(on, Eigen::Vector2d(0.015 + 0.0675 * (k % 5), 0.015 + 0.0675 * (k / 5)));
      out.col(k) = position_of(at, motion[1].samples[0]) - position_of(at, motion[0].samples[0]);
    }
    return out;
  };
  const Eigen::Matrix3Xd here = changes(sheet, hung_shape(sheet, e, 1)),
                         there = changes(triangles, cloth::hung_shape(triangles, e, 1));
  EXPECT_GT(there.colwise().norm().maxCoeff(), 5e-3);
  EXPECT_LT((here - there).norm(), 0.12 * there.norm()) << 1e3 * here << "\n" << 1e3 * there;
}

TEST(SplineEffects, AddedMassOfALaneLeavesTheOthersTheirBits) {
  const SplineSheet sheet = sheet_of(9);
  Experiment e = waved();
  e.starts_at_rest = false;
  e.start_shape = hung_shape(sheet, e, 1);
  std::vector<Experiment> lanes(3, e);
  lanes[1].material.added_mass = 0.3;
  lanes[2].material.added_mass = 0.02;
  Options options;
  options.step_s = common_step_s(sheet, lanes);
  const auto together = simulate(sheet, lanes, options);
  for (size_t i = 0; i < lanes.size(); ++i) {
    const Trajectory alone = simulate(sheet, {lanes[i]}, options)[0];
    for (size_t k = 0; k < e.sample_s.size(); ++k) EXPECT_EQ(together[i].samples[k], alone.samples[k]) << i;
  }
}

// A force as large as the fabric's weight, the other way, is no weight at all.
TEST(SplineSmoothForces, AnEvenOneIsAWeightPerArea) {
  const SplineSheet sheet = sheet_of(8);
  Experiment e = waved();
  e.starts_at_rest = true;
  e.start_shape = hung_shape(sheet, e, 1);
  Experiment lighter = e, lifted = e;
  lighter.gravity_m_s2 *= 0.9;
  lifted.smooth_forces = {{-0.1 * e.material.density * e.gravity_m_s2, 0, 0}};
  const std::vector<Trajectory> runs = simulate(sheet, {lighter, lifted, e});
  const double moved = (runs[2].samples.back() - runs[0].samples.back()).norm();
  EXPECT_LT((runs[1].start - runs[0].start).norm(), 0.02 * (runs[2].start - runs[0].start).norm());
  EXPECT_LT((runs[1].samples.back() - runs[0].samples.back()).norm(), 0.05 * moved);
}

TEST(SplineSmoothForces, AWavePushesItsCrestsApart) {
  const SplineSheet sheet = sheet_of(8);
  Experiment e = waved();
  e.start_shape = hung_shape(sheet, e, 1);
  Experiment pushed = e;
  pushed.smooth_forces = {{Eigen::Vector3d(0, 0.05, 0), 1, 0}};  // + at the left, − at the right
  const std::vector<Trajectory> runs = simulate(sheet, {e, pushed});
  const auto moved = [&](double u) {
    const SurfacePoint at = surface_point(sheet, {u, 0.28});
    return (position_of(at, runs[1].start) - position_of(at, runs[0].start)).y();
  };
  EXPECT_GT(moved(0.03), 1e-3);
  EXPECT_LT(moved(0.27), -1e-3);
}

}  // namespace
}  // namespace selvedge::cloth::spline
