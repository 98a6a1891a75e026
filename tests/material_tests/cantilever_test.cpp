// Strips simulated by other equations than those of the fit: nodes with a bending moment at each, balanced by Newton.
#include "material_tests/cantilever.h"

#include <random>

#include <gtest/gtest.h>

#include "cli/verify/proofs/strip_of_nodes.h"
#include "tests/refusal.h"

namespace selvedge::material_tests {
namespace {

trial::Trial strip_trial(const BendingLaw& law, double density, double overhang_m, double angle_deg, double noise_m = 0,
                         unsigned seed = 1) {
  trial::Trial t;
  t.name = fmt::format("{:.0f} mm", 1e3 * overhang_m);
  t.experiment = trial::Experiment::cantilever;
  t.fabric = {"made up", 0.025, 0.2, density * 0.025 * 0.2, true};
  t.cantilever = trial::Cantilever{angle_deg, overhang_m, std::nullopt,
                                   cli::every_nth(cli::strip_of_nodes(law, 9.81 * density, overhang_m, 800), 20)};
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  t.cantilever->midline_m.array() +=
      noise_m * Eigen::MatrixXd::NullaryExpr(2, t.cantilever->midline_m.cols(), [&] { return normal(random); }).array();
  return t;
}

std::vector<const trial::Trial*> pointers(const std::vector<trial::Trial>& trials) {
  std::vector<const trial::Trial*> out;
  for (const trial::Trial& t : trials) out.push_back(&t);
  return out;
}

std::vector<trial::Trial> strips(const BendingLaw& law, double density, double angle, double noise_m) {
  std::vector<trial::Trial> out;
  const double c = bending_length(law, 9.81 * density);
  unsigned seed = 1;
  for (const double ratio : {0.9, 1.2, 1.4})
    out.push_back(strip_trial(law, density, ratio * c, angle, noise_m, seed++));
  return out;
}

TEST(Cantilever, GivesBothRigiditiesBack) {
  const BendingLaw law{1.2e-5, -3.5e-8};
  const DirectionBend found = fit_direction(pointers(strips(law, 0.19, 0, 0)));
  EXPECT_NEAR(found.law.bend / law.bend, 1, 0.003);
  EXPECT_NEAR(found.law.second_order / law.second_order, 1, 0.03);
  EXPECT_TRUE(found.second_order_is_seen);
}

TEST(Cantilever, DirectionsMakeOneLaw) {
  std::vector<trial::Trial> all = strips({1.8e-5, -4e-8}, 0.19, 0, 1e-4);
  for (const trial::Trial& t : strips({0.8e-5, -2e-8}, 0.19, 90, 1e-4)) all.push_back(t);
  const Answer answer = fit_cantilever(pointers(all));
  const double truth[] = {std::sqrt(1.8e-5 * 0.8e-5), 0.5 * std::log(1.8 / 0.8)};
  size_t k = 0;
  for (const double value : truth) {
    const auto [low, high] = interval_of(answer, k++);
    EXPECT_GT(value, low - 0.5 * (high - low));
    EXPECT_LT(value, high + 0.5 * (high - low));
    EXPECT_LT(high - low, 0.5 * std::abs(value));
  }
  EXPECT_LT(named(answer, "bend_stiffening").value, 0);
}

TEST(Cantilever, IntervalsHoldTheTruthAsOftenAsTheySay) {
  const BendingLaw law{1.2e-5, -3.5e-8};
  int held = 0;
  constexpr int kDraws = 60;
  for (unsigned draw = 0; draw < kDraws; ++draw) {
    const trial::Trial t = strip_trial(law, 0.19, 0.026, 0, 2e-4, 100 + draw);
    const Answer answer = fit_cantilever({&t});
    const auto [low, high] = interval_of(answer, 0);
    held += low < law.bend && law.bend < high;
  }
  EXPECT_GE(held, 46);  // 54 of 60 expected
}

TEST(Cantilever, ABendingLengthAloneGivesPeircesRigidity) {
  trial::Trial t = strip_trial({1.2e-5, 0}, 0.19, 0.036, 45);
  t.cantilever->midline_m.resize(2, 0);
  t.cantilever->bending_length_m = 0.018;
  const Answer answer = fit_cantilever({&t});
  EXPECT_NEAR(named(answer, "bend").value / (0.19 * 9.81 * std::pow(0.018, 3)), 1, 0.06);
  EXPECT_EQ(answer.parameters.size(), 1u);
  EXPECT_EQ(answer.remarks.size(), 2u);
}

TEST(Cantilever, ALineThatNoStripTakesIsRefused) {
  trial::Trial t = strip_trial({1.2e-5, 0}, 0.19, 0.036, 0);
  t.folder = "/lab/strip-7";
  t.fabric.mass_kg = 0;
  EXPECT_NE(refusal_of([&] { fit_cantilever({&t}); }).find("/lab/strip-7"), std::string::npos);
}

}  // namespace
}  // namespace selvedge::material_tests
