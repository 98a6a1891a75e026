// Effects that only a camera sees, on frames of a waving sheet.
#include <filesystem>

#include <gtest/gtest.h>
#include <unistd.h>

#include "diagnose/effects/library.h"
#include "diagnose/seen_error.h"
#include "model/simulation.h"
#include "tests/waving_felt.h"

namespace selvedge::diagnose {
namespace {

namespace fs = std::filesystem;

class ImageEffects : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("selvedge_image_effects_" + std::to_string(::getpid()));
    const trial::Campaign campaign = record_waving_felt(folder_ / "felt");
    model::SimulationOptions options;
    options.cells = 7;
    base_ = model::base_parameters();
    usual_ = model::usual_coordinates(base_);
    simulation_ = std::make_unique<model::Simulation>(
        std::vector<model::ObservedTrial>{model::observe_trial(campaign.trials[0])}, options);
    state_ = simulation_->state_at(base_, usual_);
  }
  static void TearDownTestSuite() {
    simulation_.reset();
    fs::remove_all(folder_);
  }
  static Eigen::VectorXd residual(const std::vector<model::Parameter>& more, const std::vector<double>& values) {
    std::vector<model::Parameter> parameters = base_;
    parameters.insert(parameters.end(), more.begin(), more.end());
    Eigen::VectorXd x(static_cast<Eigen::Index>(parameters.size()));
    x.head(usual_.size()) = usual_;
    for (size_t k = 0; k < more.size(); ++k)
      x(usual_.size() + static_cast<Eigen::Index>(k)) = model::to_coordinate(more[k], values[k]);
    return simulation_->evaluate(state_, parameters, x).front().mm[0];
  }
  static inline fs::path folder_;
  static inline std::vector<model::Parameter> base_;
  static inline Eigen::VectorXd usual_;
  static inline std::unique_ptr<model::Simulation> simulation_;
  static inline model::State state_;
};

TEST_F(ImageEffects, NeutralChangesNothingAndEachParameterChangesWhatIsSeen) {
  const Eigen::VectorXd plain = residual({}, {});
  ASSERT_GT(plain.size(), 200);
  int effects = 0;
  for (const Effect& e : effect_library()) {
    if (e.applies_to != AppliesTo::images) continue;
    ++effects;
    std::vector<double> neutral;
    for (const model::Parameter& p : e.parameters) neutral.push_back(p.start);
    EXPECT_EQ(residual(e.parameters, neutral), plain) << e.name;
    for (size_t k = 0; k < e.parameters.size(); ++k) {
      std::vector<double> moved = neutral;
      moved[k] += e.parameters[k].scale;
      EXPECT_GT((residual(e.parameters, moved) - plain).cwiseAbs().maxCoeff(), 0.05)
          << e.name << " " << e.parameters[k].name;
    }
  }
  EXPECT_GE(effects, 3);
}

// Half of the rows' delay before the frame's time, half after it: nothing at the middle row, most at the first and
// last.
TEST_F(ImageEffects, ARollingShutterIsADelayThatGrowsWithTheRow) {
  for (const Effect& e : effect_library()) {
    if (e.name != "rolling_shutter") continue;
    const Eigen::VectorXd change = residual(e.parameters, {0.02}) - residual({}, {});
    const observe::StripeTrack& track = *simulation_->trials()[0].stripes;
    double outer = 0, inner = 0;
    Eigen::Index at = 0;
    for (const observe::StripeFrame& frame : track.frames) {
      for (const observe::DepthPoint& p : frame.depth) {
        const double row = p.pixel.y() / track.camera.height_px - 0.5;
        double& most = std::abs(row) < 0.03 ? inner : outer;
        most = std::max(most, std::abs(change(at++)));
      }
      at += static_cast<Eigen::Index>(frame.outline.size());
    }
    ASSERT_GT(inner, 0);
    EXPECT_GT(outer, 3 * inner);
  }
}

TEST_F(ImageEffects, AFrameIsLookedAtInSquares) {
  Protocol protocol;
  const Windows windows(*simulation_, protocol);
  protocol.seen_apart /= 2;
  const Windows finer(*simulation_, protocol);
  // Four times as many squares, less at the rim; a dozen and more a frame; fewer than were seen.
  EXPECT_GT(finer.rows(), 2 * windows.rows());
  EXPECT_LT(finer.rows(), simulation_->time_s(0).size());
  const auto frames = static_cast<Eigen::Index>(simulation_->trials()[0].stripes->frames.size());
  EXPECT_GT(windows.rows(), 12 * frames);
}

TEST_F(ImageEffects, WhatAMeshLeavesHasTheSizeOfWhatAFinerGridChanges) {
  const Windows windows(*simulation_, {});
  const Eigen::VectorXd grid = Eigen::VectorXd::Constant(windows.rows(), -0.2);
  const SeenError error = seen_error({}, *simulation_, windows, grid);
  const Eigen::MatrixXd& patterns = error.lasting;
  ASSERT_EQ(patterns.cols(), Protocol().mesh_waves * Protocol().mesh_waves);
  const Eigen::VectorXd square = patterns.rowwise().squaredNorm();
  double sum = 0;
  Eigen::Index depths = 0;
  for (Eigen::Index i = 0; i < square.size(); ++i) {
    sum += square(i);
    depths += square(i) > 0;
    EXPECT_NEAR(error.rough_mm(i), square(i) > 0 ? 0.2 : 0, 1e-9);
  }
  ASSERT_GT(depths, square.size() / 2);
  EXPECT_LT(depths, square.size());  // outline points have none
  EXPECT_NEAR(std::sqrt(sum / static_cast<double>(depths)), 0.2, 0.05);
}

}  // namespace
}  // namespace selvedge::diagnose
