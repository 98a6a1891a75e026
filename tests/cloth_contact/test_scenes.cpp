// Sheets that meet rods, floors and themselves: the short version of `prove contact`.
#include <cstdio>
#include <cmath>

#include <gtest/gtest.h>

#include "cli/verify/proofs/contact_cases.h"

namespace selvedge::cli {
namespace {

void expect_clean(const char* name, unsigned seed, const ContactOutcome& out) {
  const auto& s = out.statistics;
  std::printf(
      "%s %u: %.2f s, steps %ld, rebuilds %ld+%ld, near %.1f, impacts %ld, zones %ld, work %.3g J (most %.3g), t %.2f "
      "mm\n",
      name, seed, out.wall_s, s.steps, s.rebuilds, s.body_rebuilds, double(s.near_pairs) / double(s.steps), s.impacts,
      s.zone_steps, s.work_J, s.most_work_J, 1e3 * s.thickness_m);
  EXPECT_TRUE(out.trajectory.finite);
  EXPECT_EQ(out.intersections, 0) << name << ", seed " << seed;
  EXPECT_EQ(s.unresolved, 0) << name << ", seed " << seed;
}

TEST(ContactScenes, SheetsDroppedOverARodDoNotIntersect) {
  for (unsigned seed = 1; seed <= 4; ++seed) expect_clean("rod", seed, run_contact_scene(sheet_over_rod(seed, 25, 1)));
}

TEST(ContactScenes, FoldedSheetsDoNotIntersect) {
  for (unsigned seed = 1; seed <= 4; ++seed) expect_clean("fold", seed, run_contact_scene(folded_sheet(seed, 25, 0.6)));
}

TEST(ContactScenes, OtherIntegratorsHandTheirStepsToContactToo) {
  const ContactScene rod = sheet_over_rod(2, 13, 0.5), fold = folded_sheet(2, 13, 0.4);
  cloth::Options runge_kutta, implicit;
  runge_kutta.integrator = cloth::Options::Integrator::runge_kutta_45;
  runge_kutta.tolerance_m = 1e-5;
  implicit.integrator = cloth::Options::Integrator::implicit_euler;
  implicit.step_s = 1.0 / 960;
  for (const cloth::Options& options : {runge_kutta, implicit}) {
    expect_clean("rod", 2, run_contact_scene(rod, true, options));
    const ContactOutcome out = run_contact_scene(fold, true, options);
    expect_clean("fold", 2, out);
    EXPECT_LT(out.statistics.work_J, -1e-4);
    EXPECT_LE(out.statistics.most_work_J, 1e-9);
  }
  ContactScene through = folded_sheet(1, 25, 0.3);
  through.options.self_collision = false;
  EXPECT_GT(run_contact_scene(through, true, runge_kutta).intersections, 0);
  expect_clean("fold", 1, run_contact_scene(folded_sheet(1, 25, 0.3), true, runge_kutta));
}

TEST(ContactScenes, WithoutContactTheSameSheetsPassThroughThemselves) {
  ContactScene scene = folded_sheet(1, 25, 0.3);
  scene.options.self_collision = false;
  EXPECT_GT(run_contact_scene(scene).intersections, 0);
}

TEST(ContactScenes, ContactGivesNoEnergy) {
  for (unsigned seed = 11; seed <= 12; ++seed) {
    const ContactOutcome rod = run_contact_scene(sheet_over_rod(seed, 17, 0.5)),
                         fold = run_contact_scene(folded_sheet(seed, 17, 0.4));
    EXPECT_LT(rod.statistics.work_J, -1e-4);
    EXPECT_LT(fold.statistics.work_J, -1e-4);
    EXPECT_LE(rod.statistics.most_work_J, 1e-9);
    EXPECT_LE(fold.statistics.most_work_J, 1e-9);
  }
}

double slid_m(double angle_rad, double friction) {
  const ContactScene scene = patch_on_incline(angle_rad, friction, 0.4);
  const ContactOutcome out = run_contact_scene(scene);
  return (out.trajectory.samples.back() - out.trajectory.start).colwise().norm().mean();
}

TEST(ContactScenes, APatchSlidesBeyondTheFrictionAngle) {
  for (const double friction : {0.2, 0.5}) {
    const double angle = std::atan(friction);
    EXPECT_LT(slid_m(angle - 0.02, friction), 1e-3);
    const double expected = 0.5 * 9.81 * (std::sin(angle + 0.1) - friction * std::cos(angle + 0.1)) * 0.4 * 0.4;
    EXPECT_NEAR(slid_m(angle + 0.1, friction), expected, 0.05 * expected);
  }
}

TEST(ContactScenes, AnIdleFilterKeepsEveryBit) {
  const ContactScene scene = folded_sheet(5, 13, 0.05);  // falls, and meets nothing yet
  const cloth::Sheet sheet = cloth::make_sheet(scene.mesh);
  cloth::Experiment with = scene.experiment;
  int steps = 0;
  with.make_step_filter = [&] { return [&](const cloth::kernel::Step&) { ++steps; }; };
  const auto plain = cloth::simulate(sheet, {scene.experiment})[0], filtered = cloth::simulate(sheet, {with})[0];
  EXPECT_GT(steps, 0);
  ASSERT_EQ(plain.samples.size(), filtered.samples.size());
  for (size_t i = 0; i < plain.samples.size(); ++i) EXPECT_EQ(plain.samples[i], filtered.samples[i]);
  EXPECT_EQ(run_contact_scene(scene).trajectory.samples.back(), run_contact_scene(scene).trajectory.samples.back());
}

}  // namespace
}  // namespace selvedge::cli
