// What a diagnosis foretells of a motion that was not recorded, of a small campaign simulated by the model itself.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "diagnose/base_fit.h"
#include "diagnose/effects/library.h"
#include "diagnose/next_experiment.h"
#include "tests/diagnose/simulated_campaign.h"

namespace selvedge::diagnose {
namespace {

class ForecastOf : public testing::Test {
 protected:
  ForecastOf() {
    std::vector<Effect> effects = effect_library();
    std::erase_if(effects, [](const Effect& e) { return e.name != "stretch_stiffening"; });
    const SimulatedSwatch swatch = usual_fabric();
    StudyOptions options;
    options.protocol.cells = 6;
    options.base_fit = BaseFit{base_of(swatch, swatch.material.stretch, swatch.material.shear), 0, {}};
    study_ = std::move(make_study(simulated_campaign(swatch), effects, options).study);
    base_ = {"none", study_.state, study_.base, {study_.base, study_.base}};
    softer_ = base_;
    softer_.name = "stretch_stiffening";
    softer_.x(static_cast<Eigen::Index>(study_.first_parameter[0])) = -0.5;
    softer_.without = {softer_.x, softer_.x};
  }
  // So much softer where it is stretched that nothing holds it together.
  Eigen::VectorXd endless() const {
    Eigen::VectorXd x = study_.base;
    x(static_cast<Eigen::Index>(study_.first_parameter[0])) = -1000;
    return x;
  }
  Study study_;
  PredictedSet base_, softer_;
};

TEST_F(ForecastOf, AMotionSaysHowFarTheTwoComeApart) {
  const Forecast f = forecast(study_, base_, softer_, 0.5);
  EXPECT_FALSE(f.motion.empty());
  EXPECT_GT(f.before_mm, 0.5);
  EXPECT_LE(f.low_mm, f.before_mm);
  EXPECT_GE(f.low_mm, f.after_mm);
  EXPECT_GE(f.high_mm, f.before_mm);
  EXPECT_EQ(f.after_mm, 0.5);
  EXPECT_GT(f.moving_s, 0.1);
}

// Two that diverged were said to lie nowhere apart.
TEST_F(ForecastOf, WhatDivergesIsNone) {
  softer_.x = endless();
  EXPECT_TRUE(forecast(study_, base_, softer_, 0.5).motion.empty());
}

TEST_F(ForecastOf, AGroupThatDivergesLeavesItWithoutInterval) {
  softer_.without[0] = endless();
  const Forecast f = forecast(study_, base_, softer_, 0.5);
  EXPECT_FALSE(f.motion.empty());
  EXPECT_GT(f.before_mm, 0.5);
  EXPECT_TRUE(std::isnan(f.low_mm));
  EXPECT_TRUE(std::isnan(f.high_mm));
}

}  // namespace
}  // namespace selvedge::diagnose
