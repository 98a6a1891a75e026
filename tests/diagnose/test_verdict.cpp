// From held-out errors to probabilities.
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "diagnose/effects/library.h"
#include "diagnose/base_fit.h"
#include "diagnose/verdict.h"
#include "tests/diagnose/simulated_campaign.h"

namespace selvedge::diagnose {
namespace {

// A study whose base model leaves in every group e^above times what a right one leaves; judged with the base alone.
class Verdict : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::vector<Effect> two;
    for (const Effect& e : effect_library())
      if (e.name == "camera_delay" || e.name == "draught") two.push_back(e);
    StudyOptions options;
    options.protocol.cells = 6;
    options.protocol.rate_hz = 20;
    options.base_fit = BaseFit{model::usual_coordinates(model::base_parameters()), 0, {}, {}};
    study_ = new Study(std::move(make_study(simulated_campaign(usual_fabric()), two, options).study));
  }
  static void TearDownTestSuite() { delete study_; }

  static Scores with_gap(double above) {
    const Floor floor = floor_of(*study_, calibration_);
    HeldOut held;
    held.mm = std::exp(above) * floor.right_mm.transpose();
    return score(*study_, {base_hypothesis(*study_)}, held, floor, calibration_);
  }
  // The base, either effect and both together, each with what it leaves in every group over what a right model leaves.
  static Scores with_two(double base, double one, double other, double both) {
    const Floor floor = floor_of(*study_, calibration_);
    std::vector<Hypothesis> all(4, base_hypothesis(*study_));
    all[1].effects = {0};
    all[2].effects = {1};
    all[3].effects = {0, 1};
    HeldOut held;
    held.mm.resize(4, floor.right_mm.size());
    const std::array<double, 4> left = {base, one, other, both};
    for (int i = 0; i < 4; ++i) held.mm.row(i) = left[static_cast<size_t>(i)] * floor.right_mm.transpose();
    return score(*study_, all, held, floor, calibration_);
  }
  static double none_against_delay(const Scores& s) {
    return s.probability.at("none") / s.probability.at("camera_delay");
  }

  static inline const Protocol calibration_;
  static inline Study* study_ = nullptr;
};

TEST_F(Verdict, NoneLosesByAsMuchAsAPlainGapIsRare) {
  const Scores nothing = with_gap(calibration_.null_mean),
               plain = with_gap(calibration_.null_mean + 6 * calibration_.null_sd);
  EXPECT_NEAR(nothing.p_value, 0.5, 1e-9);
  EXPECT_NEAR(plain.p_value, 0.00194, 2e-5);  // Student's distribution with 4 degrees of freedom, six spreads away
  EXPECT_NEAR(none_against_delay(plain) / none_against_delay(nothing), plain.p_value / calibration_.plain_gap, 1e-6);
}

TEST_F(Verdict, NoneLosesNothingWhereSuchGapsAreUsual) {
  const Scores usual = with_gap(calibration_.null_mean + calibration_.null_sd);
  EXPECT_GT(usual.p_value, calibration_.plain_gap);
  EXPECT_NEAR(none_against_delay(usual), none_against_delay(with_gap(calibration_.null_mean)), 1e-9);
}

TEST_F(Verdict, TwoEffectsShareWhatTheyHaveTogether) {
  const Scores s = with_two(6, 4, 5, 1);
  EXPECT_EQ(s.likeliest, "camera_delay+draught");
  EXPECT_GT(s.of_two.at(s.likeliest), 0.9);
  EXPECT_NEAR(s.probability.at("camera_delay"), 0.5 * s.of_two.at(s.likeliest), 0.02);
  EXPECT_NEAR(s.probability.at("draught"), 0.5 * s.of_two.at(s.likeliest), 0.02);
  double sum = 0;
  for (const auto& [name, p] : s.probability) sum += p;
  EXPECT_NEAR(sum, 1, 1e-12);
  EXPECT_FALSE(s.probability.contains(s.likeliest));
}

TEST_F(Verdict, ASecondEffectThatWinsLittleIsNotSaidToBeThere) {
  const Scores s = with_two(6, 1.05, 5, 1);
  EXPECT_EQ(s.likeliest, "camera_delay");
  EXPECT_LT(s.of_two.at("camera_delay+draught"), 0.1);
}

TEST_F(Verdict, TwoEffectsThatCloseLittleAreNotSaidToBeThere) {
  EXPECT_EQ(with_two(6, 5, 5.2, 4.6).likeliest, "unknown");
}

}  // namespace
}  // namespace selvedge::diagnose
