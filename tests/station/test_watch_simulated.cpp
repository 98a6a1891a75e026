// The watch over campaigns of the simulated world, whose truth is known: knocks of camera and projector, and late
// frames.
#include <filesystem>

#include <gtest/gtest.h>
#include <unistd.h>

#include "hardware_sim/recorded_world/recorded_world.h"
#include "hardware_sim/world/world.h"
#include "station/calibration_watch.h"
#include "station/pattern_images.h"
#include "station/projector_check.h"

namespace selvedge::station {
namespace {

using hardware_sim::Knock;

class WatchedWorld : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove_all(folder_); }
  CalibrationWatch watch(const hardware_sim::RecordingOptions& options, const Knock& knock = {}) {
    auto world = hardware_sim::read_world(rig::Configuration::parse("", "test", hardware_sim::world_sections()));
    world.lattice.cells_across = world.lattice.cells_down = 8;
    world.knock = knock;
    return watch_calibration(hardware_sim::record_campaign(world, options, folder_), [](double, const std::string&) {});
  }
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("selvedge_watch_" + std::to_string(getpid()));
};

TEST_F(WatchedWorld, NothingMovedNothingIsAccused) {
  const CalibrationWatch watch = this->watch({.trials = 3, .duration_s = 1.5});
  EXPECT_FALSE(watch.moved()) << to_text(watch);
  for (const calib::Drift* drift : {&watch.camera, &watch.projector})
    for (const calib::TrialDrift& d : drift->trials) EXPECT_TRUE(d.judged) << to_text(watch);
  for (size_t i = 1; i < watch.trials.size(); ++i) {
    EXPECT_TRUE(watch.trials[i].delay.known) << watch.trials[i].delay.why;
    EXPECT_LT(std::abs(watch.trials[i].delay.offset_s), 3 * watch.trials[i].delay.sd_s) << to_text(watch);
  }
}

TEST_F(WatchedWorld, LateFramesAreFoundWithAnHonestDeviation) {
  const CalibrationWatch watch = this->watch({.trials = 2, .late_s = 0.011});
  const calib::TimeOffset& delay = watch.trials[1].delay;
  ASSERT_TRUE(delay.known) << delay.why;
  EXPECT_NEAR(delay.offset_s, -0.011, 3 * delay.sd_s) << to_text(watch);
  EXPECT_LT(delay.sd_s, 0.002);
}

TEST_F(WatchedWorld, AProjectorKnockedBetweenTrialsIsNamedWithItsTrialAndTheCameraIsNot) {
  // 0.15 degrees about its x axis: f = 2575 rows, so 6.7 of them.
  const CalibrationWatch watch =
      this->watch({.trials = 3, .duration_s = 1.5, .knocked_trial = 2}, {Knock::Device::projector, {0.15, 0, 0}});
  EXPECT_FALSE(watch.camera.since) << to_text(watch);
  ASSERT_TRUE(watch.projector.since) << to_text(watch);
  EXPECT_EQ(*watch.projector.since, "waving-2") << to_text(watch);
  for (size_t i = 2; i < 3; ++i)
    EXPECT_NEAR(watch.projector.trials[i].shift_px, 0.15 * M_PI / 180 * 2575, 1.5) << to_text(watch);
}

TEST_F(WatchedWorld, ACameraKnockedBetweenTrialsIsNamedWithItsTrialAndTheProjectorIsNot) {
  const CalibrationWatch watch =
      this->watch({.trials = 3, .duration_s = 1.5, .knocked_trial = 1}, {Knock::Device::camera, {0.2, 0.45, 0}});
  EXPECT_FALSE(watch.projector.since) << to_text(watch);
  ASSERT_TRUE(watch.camera.since) << to_text(watch);
  EXPECT_EQ(*watch.camera.since, "waving-1") << to_text(watch);
  for (size_t i = 1; i < 3; ++i)
    EXPECT_NEAR(watch.camera.trials[i].shift_px, std::hypot(0.2, 0.45) * M_PI / 180 * 1060, 1.0) << to_text(watch);
}

// A fabric that hangs still under the grey code, read as a session reads it before a trial.
ProjectorCheck check_in(const hardware_sim::WorldConfiguration& stands,
                        const hardware_sim::WorldConfiguration& calibrated) {
  hardware_sim::World world(stands, 0, hardware_sim::Clockwork::by_hand);
  projector::Pattern shown;
  world.set_pattern_source([&](double) { return shown; });
  world.on_prompt({.step = "hang_still"}, 0);
  constexpr double kAtRest_s = 2;
  world.advance_to(kAtRest_s);
  std::vector<calib::PatternImage> sequence;
  for (const calib::PatternStep& step :
       calib::coarse_code_sequence({stands.projector.width_px, stands.projector.height_px})) {
    shown = to_pattern(step);
    sequence.push_back({step, calib::GreyImage(stands.camera.height_px, stands.camera.width_px)});
    EXPECT_TRUE(world.image_at(kAtRest_s, sequence.back().image.data()));
  }
  const auto markers = world.markers_at(kAtRest_s);
  return decode_corners(sequence, {markers.at(0).position_m, markers.at(1).position_m}, calibrated.camera);
}

// A turn about the vertical moves the stripes along themselves: they show nothing of it, the grey code does.
TEST_F(WatchedWorld, AProjectorTurnedAlongItsStripesIsNamedByTheGreyCode) {
  auto world = hardware_sim::read_world(rig::Configuration::parse("", "test", hardware_sim::world_sections()));
  world.lattice.cells_across = world.lattice.cells_down = 8;
  world.knock = {Knock::Device::projector, {0, 0.25, 0}};
  const trial::Campaign campaign =
      hardware_sim::record_campaign(world, {.trials = 2, .duration_s = 1, .knocked_trial = 1}, folder_);
  const auto judged = [&] { return watch_calibration(campaign, [](double, const std::string&) {}); };
  EXPECT_FALSE(judged().moved()) << to_text(judged());
  write_projector_check(check_in(world, world), campaign.trials[0].folder);
  write_projector_check(check_in(hardware_sim::knocked(world), world), campaign.trials[1].folder);
  const CalibrationWatch watch = judged();
  ASSERT_TRUE(watch.projector.since) << to_text(watch);
  EXPECT_EQ(*watch.projector.since, "waving-1") << to_text(watch);
  EXPECT_FALSE(watch.camera.since) << to_text(watch);
  EXPECT_NEAR(watch.projector.trials[1].shift_px, 0.25 * M_PI / 180 * 1290, 1) << to_text(watch);
  EXPECT_LT(watch.projector.trials[0].shift_px, 1) << to_text(watch);
}

}  // namespace
}  // namespace selvedge::station
