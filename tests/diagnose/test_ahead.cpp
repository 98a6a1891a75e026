// Predictions for a quarter of a second ahead.
#include <cmath>

#include <gtest/gtest.h>

#include "diagnose/ahead.h"
#include "model/trial_error.h"
#include "fit/stages.h"
#include "tests/diagnose/simulated_campaign.h"

namespace selvedge::diagnose {
namespace {

class Ahead : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const SimulatedSwatch swatch = usual_fabric();
    right_ = base_of(swatch, swatch.material.stretch, swatch.material.shear);
    model::SimulationOptions options;
    options.cells = 9;
    simulation_ = std::make_unique<model::Simulation>(
        fit::observe_campaign(simulated_campaign(swatch), 20, 10, [](double, const std::string&) {}), options);
    state_ = simulation_->state_at(base_, right_);
  }
  static void TearDownTestSuite() { simulation_.reset(); }

  // Air resists three times as much.
  static Eigen::VectorXd wrong() {
    Eigen::VectorXd x = right_;
    for (size_t k = 0; k < base_.size(); ++k)
      if (base_[k].name.starts_with("drag_normal"))
        x(static_cast<Eigen::Index>(k)) =
            model::to_coordinate(base_[k], 3 * model::to_value(base_[k], x(static_cast<Eigen::Index>(k))));
    return x;
  }

  static inline const std::vector<model::Parameter> base_ = model::base_parameters();
  static inline Eigen::VectorXd right_;
  static inline std::unique_ptr<model::Simulation> simulation_;
  static inline model::State state_;
};

TEST_F(Ahead, ShowsWhatAModelLacksWithoutWhatGrowsFromItForSeconds) {
  Eigen::MatrixXd sets(right_.size(), 2);
  sets << right_, wrong();
  const Eigen::MatrixXd mm = ahead_mm(*simulation_, state_, Protocol{}, base_, sets);
  const model::Residuals free = simulation_->evaluate(state_, base_, sets).back();
  ASSERT_EQ(mm.rows(), 2);
  for (Eigen::Index trial = 1; trial < 3; ++trial) {  // the first one hangs still
    const auto i = static_cast<size_t>(trial);
    EXPECT_LT(mm(0, trial), 1) << "noise is 0.35 mm in space";
    EXPECT_GT(mm(1, trial), 1.3 * mm(0, trial));
    EXPECT_LT(mm(1, trial), model::rms_mm(simulation_->trials()[i], free.mm[i], simulation_->time_s(i)));
  }
  EXPECT_NEAR(mm(1, 0), mm(0, 0), 0.05) << "air that rests does not show in what hangs still";
}

TEST_F(Ahead, TrialsThatAreNotWantedStayOut) {
  const Eigen::MatrixXd all = ahead_mm(*simulation_, state_, Protocol{}, base_, right_),
                        one = ahead_mm(*simulation_, state_, Protocol{}, base_, right_, {1});
  EXPECT_EQ(one(0, 1), all(0, 1));
  EXPECT_TRUE(std::isnan(one(0, 0)) && std::isnan(one(0, 2)));
  EXPECT_EQ(ahead_mm(*simulation_, state_, Protocol{}, base_, right_, {0})(0, 0), all(0, 0));
}

}  // namespace
}  // namespace selvedge::diagnose
