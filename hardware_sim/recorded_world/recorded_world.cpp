#include "hardware_sim/recorded_world/recorded_world.h"

#include <cmath>
#include <random>

#include <fmt/format.h>

#include "capture/trial/trial_writer.h"
#include "hardware_sim/world/world.h"

namespace selvedge::hardware_sim {

namespace {

constexpr double kHangs_s = 3.2;  // from the prompt until the fabric hangs and the hand has let go

projector::Pattern stripes(const RecordingOptions& options) {
  return {.kind = projector::PatternKind::stripes,
          .orientation = projector::Orientation::horizontal,
          .period_px = options.stripe_period_px};
}

trial::Trial description(const WorldConfiguration& world, const RecordingOptions& options, bool waved) {
  trial::Trial trial;
  trial.experiment = waved ? trial::Experiment::waving : trial::Experiment::static_hang;
  trial.fabric = {"simulated", world.fabric.width_m, world.fabric.height_m,
                  world.fabric.density * world.fabric.width_m * world.fabric.height_m, true};
  trial.starts_at_rest = true;
  trial.camera = world.camera;
  trial.projector = world.projector;
  trial.pattern = trial::StripePattern{"horizontal", options.stripe_period_px, 0.5, 0};
  trial.frame_rate_hz = options.camera_rate_hz;
  trial.mocap_rate_hz = options.tracker_rate_hz;
  trial.mocap_noise_m = options.tracker_noise_m;
  trial.noise_grey_levels = world.noise_grey;
  return trial;
}

// The fabric hung afresh before devices that stand as in `stands`; the trial says what `calibrated` says.
void record_trial(const WorldConfiguration& calibrated, const WorldConfiguration& stands,
                  const RecordingOptions& options, size_t index, const std::filesystem::path& folder) {
  const bool waved = index > 0;
  World world(stands, 0, Clockwork::by_hand);
  world.set_pattern_source([&](double) { return stripes(options); });
  world.on_prompt({.step = "hang_still"}, 0);
  world.on_prompt({.step = "stand_back"}, kHangs_s - 0.4);
  if (waved)
    world.on_prompt({.step = "wave_right_corner",
                     .amplitude_m = options.amplitude_m,
                     .frequency_hz = options.frequency_hz,
                     .duration_s = options.duration_s},
                    kHangs_s - 0.2);
  trial::Trial trial = description(calibrated, options, waved);
  std::mt19937 random(options.seed + static_cast<unsigned>(index));
  std::normal_distribution<double> noise(0, options.tracker_noise_m);
  const auto noisy = [&](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(p.x() + noise(random), p.y() + noise(random), p.z() + noise(random));
  };

  const auto samples = static_cast<Eigen::Index>(options.duration_s * options.tracker_rate_hz);
  const auto frames = static_cast<int>(options.duration_s * options.camera_rate_hz);
  trial.corners.left.resize(3, samples);
  trial.corners.right.resize(3, samples);
  trial.frames.emplace();
  std::vector<trial::GreyImage> images;
  Eigen::Index sample = 0;
  int frame = 0;
  while (sample < samples || frame < frames) {
    const double sample_s = static_cast<double>(sample) / options.tracker_rate_hz,
                 frame_s = (frame + 0.5) / options.camera_rate_hz;
    if (sample < samples && (frame >= frames || sample_s <= frame_s)) {
      world.advance_to(kHangs_s + sample_s);
      const auto markers = world.markers_at(kHangs_s + sample_s);
      trial.corners.time_s.push_back(sample_s);
      trial.corners.left.col(sample) = noisy(markers.at(0).position_m);
      trial.corners.right.col(sample++) = noisy(markers.at(1).position_m);
    } else {
      world.advance_to(kHangs_s + frame_s);
      trial.frames->number.push_back(frame++);
      trial.frames->time_s.push_back(frame_s + options.late_s);
      trial::GreyImage& image = images.emplace_back(stands.camera.height_px, stands.camera.width_px);
      world.image_at(kHangs_s + frame_s, image.data());
    }
  }
  trial::write_trial(trial, folder, images);
}

}  // namespace

trial::Campaign record_campaign(const WorldConfiguration& world, const RecordingOptions& options,
                                const std::filesystem::path& folder) {
  trial::Campaign campaign;
  campaign.fabric = "simulated";
  for (size_t i = 0; i < options.trials; ++i) {
    const WorldConfiguration stands = i >= options.knocked_trial ? knocked(world) : world;
    campaign.trials.emplace_back().name = i == 0 ? "static-1" : fmt::format("waving-{}", i);
    record_trial(world, stands, options, i, folder / campaign.trials.back().name);
  }
  trial::write_campaign_json(campaign, folder);
  return trial::read_campaign(folder);
}

}  // namespace selvedge::hardware_sim
