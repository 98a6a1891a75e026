// Pulls made by closed forms of the sheet's law, and what is made of them.
#include "material_tests/tensile.h"

#include <random>

#include <gtest/gtest.h>

#include "tests/refusal.h"

namespace selvedge::material_tests {
namespace {

constexpr double kWidth = 0.05;

trial::Trial strip(double angle_deg) {
  trial::Trial t;
  t.name = fmt::format("{}°", angle_deg);
  t.folder = "/lab/" + t.name;
  t.experiment = trial::Experiment::tensile;
  t.fabric = {"made up", kWidth, 0.2, 0.002, true};
  t.tensile = trial::Tensile{angle_deg, kWidth, 0.1, "N", {}};
  return t;
}

// force(stretch) and across(stretch) of a strip that is pulled to `longest` and, with back, let go to rest with a share
// of the force.
template <class Force, class Across>
trial::Pull made_pull(int number, double longest, const Force& force, const Across& across, double noise,
                      double back = 0) {
  trial::Pull p;
  p.number = number;
  std::mt19937 random(static_cast<unsigned>(number));
  std::normal_distribution<double> normal(0, noise);
  const int n = 300;
  for (int i = 0; i <= (back > 0 ? 2 * n : n); ++i) {
    const double share = i <= n ? i / double(n) : 2 - i / double(n), stretch = 1 + share * (longest - 1);
    p.time_s.push_back(0.1 * i);
    p.force.push_back(force(stretch) * (i <= n ? 1 : back));
    p.stretch_along.push_back(stretch + normal(random));
    p.stretch_across.push_back(across(stretch) + normal(random));
  }
  return p;
}

// σ_u = k_u (1 − ν²) ε_u and ε_v = −ν √(k_u / k_v) ε_u where nothing stiffens.
std::vector<trial::Trial> linear_pulls(double ku, double kv, double nu) {
  std::vector<trial::Trial> out = {strip(0), strip(90)};
  for (int number = 1; number < 4; ++number) {
    out[0].tensile->pulls.push_back(made_pull(
        number, 1.1, [&](double s) { return kWidth * ku * (1 - nu * nu) * (s - 1); },
        [&](double s) { return 1 - nu * std::sqrt(ku / kv) * (s - 1); }, 3e-4));
    out[1].tensile->pulls.push_back(made_pull(
        10 + number, 1.1, [&](double s) { return kWidth * kv * (1 - nu * nu) * (s - 1); },
        [&](double s) { return 1 - nu * std::sqrt(kv / ku) * (s - 1); }, 3e-4));
  }
  return out;
}

TEST(Tensile, BothDirectionsGiveOneLaw) {
  const auto trials = linear_pulls(300, 100, 0.4);
  const Answer answer = fit_tensile({&trials[0], &trials[1]});
  EXPECT_NEAR(named(answer, "stretch").value, std::sqrt(300.0 * 100), 3);
  EXPECT_NEAR(named(answer, "stretch_anisotropy").value, 0.5 * std::log(3), 0.02);
  EXPECT_NEAR(named(answer, "coupling").value, 0.4, 0.02);
  EXPECT_NEAR(named(answer, "stretch_stiffening").value, 0, 0.3);
  EXPECT_EQ(answer.pictures.size(), 4u);
}

TEST(Tensile, FindsStiffening) {
  trial::Trial t = strip(90);
  for (int number = 1; number < 3; ++number)
    t.tensile->pulls.push_back(made_pull(
        number, 1.3, [](double s) { return kWidth * 80 * (s - 1) * (1 + 6 * (s - 1)); }, [](double) { return 1; },
        3e-4));
  const Answer answer = fit_tensile({&t});
  EXPECT_NEAR(named(answer, "stretch").value, 80, 3);
  EXPECT_NEAR(named(answer, "stretch_stiffening").value, 6, 0.4);
  EXPECT_NEAR(named(answer, "coupling").value, 0, 0.02);
  EXPECT_EQ(answer.parameters.size(), 3u);  // no anisotropy of one direction
}

TEST(Tensile, SaysHowFarTheSheetsLawHolds) {
  trial::Trial t = strip(0);
  for (int number = 1; number < 4; ++number)
    t.tensile->pulls.push_back(made_pull(
        number, 1.9, [](double s) { return kWidth * 20 * (s - 1) * std::exp(std::pow((s - 1) / 0.9, 4)); },
        [](double s) { return 1 - 0.2 * (s - 1); }, 2e-3));
  const Answer answer = fit_tensile({&t});
  double holds = 0;
  for (const Reported& r : answer.reported)
    if (r.name == "stretch up to which the sheet's law holds") holds = r.value;
  EXPECT_GT(holds, 1.1);
  EXPECT_LT(holds, 2);
  EXPECT_NEAR(named(answer, "stretch").value, 20, 3);
}

TEST(Tensile, TheLawOfLargeStrainIsTheSheetsWhereStrainIsSmall) {
  StretchLaw sheet{{300, 100}, 0.4, {5, 5}}, large = sheet;
  large.large = true;
  const Eigen::ArrayXd force = Eigen::ArrayXd::LinSpaced(5, 0, 0.5);
  for (const int direction : {0, 1}) {
    const Pulled a = pulled(sheet, direction, force), b = pulled(large, direction, force);
    for (Eigen::Index i = 1; i < 5; ++i) {
      EXPECT_NEAR((b.along(i) - 1) / (a.along(i) - 1), 1, 0.02);
      EXPECT_NEAR((b.across(i) - 1) / (a.across(i) - 1), 1, 0.02);
    }
  }
}

TEST(Tensile, HysteresisIsTheWorkThatDoesNotComeBack) {
  trial::Trial t = strip(0);
  for (int number = 1; number < 3; ++number)
    t.tensile->pulls.push_back(made_pull(
        number, 1.2, [](double s) { return kWidth * 100 * (s - 1); }, [](double) { return 1; }, 0, 0.7));
  const Answer answer = fit_tensile({&t});
  const Reported& loss = answer.reported.back();
  EXPECT_EQ(loss.name, "work lost in a cycle");
  EXPECT_NEAR(loss.value, 0.3, 0.01);
}

TEST(Tensile, UnknownUnitsLeaveStretchOpenAndAreNamed) {
  auto trials = linear_pulls(300, 100, 0.4);
  trials[0].tensile->force_unit = trials[1].tensile->force_unit = "counts";
  const Answer answer = fit_tensile({&trials[0], &trials[1]});
  EXPECT_THROW(named(answer, "stretch"), std::out_of_range);
  EXPECT_NEAR(named(answer, "stretch_anisotropy").value, 0.5 * std::log(3), 0.02);
  EXPECT_NE(answer.remarks.front().find("counts"), std::string::npos);
  trials[1].tensile->force_unit = "N";
  EXPECT_NE(refusal_of([&] { fit_tensile({&trials[0], &trials[1]}); }).find("90°"), std::string::npos);
}

TEST(Tensile, APullThatDoesNotPullIsRefused) {
  trial::Trial t = strip(0);
  t.tensile->pulls.push_back(made_pull(
      7, 1.2, [](double) { return 0.0; }, [](double) { return 1; }, 0));
  EXPECT_NE(refusal_of([&] { fit_tensile({&t}); }).find("pull 7"), std::string::npos);
}

}  // namespace
}  // namespace selvedge::material_tests
