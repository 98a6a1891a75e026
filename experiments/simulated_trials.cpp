#include "experiments/simulated_trials.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Geometry>

#include "capture/trial/trial_writer.h"
#include "cloth/spline/simulate.h"
#include "cloth/spline/view.h"
#include "render/stripe_renderer.h"

namespace selvedge::experiments {

namespace {

constexpr double kTracker_hz = 120, kRest_s = 0.1, kGather_s = 0.4;

Eigen::Vector3d right_corner(const TrialPlan& plan, double t) {
  const double since = t - kRest_s, angle = 2 * M_PI * plan.frequency_hz * since;
  double swing = 0;
  if (plan.kind == trial::Experiment::waving && since > 0) swing = 0.5 * (1 - std::cos(angle));
  if (plan.kind == trial::Experiment::robot && since > 0) {
    const double share = std::min(1.0, since / kGather_s);
    swing = share * share * (3 - 2 * share) * std::sin(angle);
  }
  const double up = plan.kind == trial::Experiment::waving ? 0.4 : 0;
  return {plan.apart_m / 2, plan.amplitude_m * swing, up * plan.amplitude_m * swing};
}

trial::GreyImage with_noise(render::Image image, double sd, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0, sd);
  trial::GreyImage out(image.rows(), image.cols());
  for (Eigen::Index i = 0; i < image.size(); ++i) {
    const double noise = sd > 0 ? normal(random) : 0;
    out(i) = static_cast<unsigned char>(std::clamp(std::lround(image(i) + noise), 0L, 255L));
  }
  return out;
}

trial::Trial blank_trial(const Fabric& fabric, const TrialPlan& plan, const TrialProtocol& protocol) {
  trial::Trial t;
  t.name = plan.name;
  t.experiment = plan.kind;
  t.fabric = {fabric.name, protocol.size_m, protocol.size_m,
              fabric.material.density * protocol.size_m * protocol.size_m, true};
  t.starts_at_rest = true;
  // Camera and projector as far away as the sheet is large, so that it fills the picture.
  const double scale = protocol.size_m / 0.3;
  const Eigen::Vector3d middle = scale * Eigen::Vector3d(0, 0.02, -0.15);
  t.camera = geometry::looking_at(scale * Eigen::Vector3d(0.05, -1.0, -0.1), middle, 880, 640, 480);
  t.projector = geometry::looking_at(scale * Eigen::Vector3d(-0.1, -0.95, 0.4), middle, 1450, 1024, 768);
  t.pattern = trial::StripePattern{"horizontal", 16, 0.5, 0};
  t.frame_rate_hz = protocol.frame_rate_hz;
  t.mocap_rate_hz = kTracker_hz;
  t.mocap_noise_m = protocol.noise_m;
  t.noise_grey_levels = protocol.noise_grey;
  return t;
}

void record_trial(const Fabric& fabric, const TrialPlan& plan, const TrialProtocol& protocol,
                  const std::filesystem::path& folder, std::mt19937_64& random) {
  trial::Trial t = blank_trial(fabric, plan, protocol);
  const int frames = plan.kind == trial::Experiment::static_hang ? 1 : plan.frames > 0 ? plan.frames : protocol.frames;
  const int samples = static_cast<int>(frames * kTracker_hz / protocol.frame_rate_hz) + 12;
  Eigen::Matrix3Xd left(3, samples), right(3, samples);
  for (int i = 0; i < samples; ++i) {
    t.corners.time_s.push_back(i / kTracker_hz);
    left.col(i) = Eigen::Vector3d(-plan.apart_m / 2, 0, 0);
    right.col(i) = right_corner(plan, i / kTracker_hz);
  }
  const cloth::spline::Swatch swatch{protocol.size_m, protocol.size_m};
  const cloth::spline::SplineSheet sheet =
      make_spline_sheet(swatch, make_grid(swatch, cloth::Hold::corners, protocol.size_m / protocol.cells));
  const cloth::spline::View view(sheet);
  cloth::Experiment e;
  e.material = fabric.material;
  e.path = cloth::make_path(cloth::Hold::corners, t.corners.time_s, left, right);
  e.start_shape = hung_shape(sheet, e, 1);
  t.frames.emplace();
  for (int k = 0; k < frames; ++k) {
    t.frames->number.push_back(k);
    t.frames->time_s.push_back(k / protocol.frame_rate_hz);
  }
  e.sample_s = t.frames->time_s;
  const cloth::Trajectory run = simulate(sheet, {e}).front();
  if (!run.finite)
    throw std::runtime_error(
        fabric.name + ", " + plan.name +
        ": the simulated recording diverged; a stiffer or heavier fabric, or less motion, may help");

  render::StripeRenderer renderer(*t.camera, *t.projector);
  renderer.set_pattern({true, t.pattern->period_px, t.pattern->duty, t.pattern->first_bright_row_px});
  std::vector<trial::GreyImage> images;
  for (const Eigen::Matrix3Xd& shape : run.samples)
    images.push_back(with_noise(renderer.render(view.of(shape), view.mesh().triangles), protocol.noise_grey, random));
  std::normal_distribution<double> normal(0, protocol.noise_m);
  const auto seen = [&](Eigen::Matrix3Xd path) {
    for (Eigen::Index i = 0; i < path.size(); ++i) path(i) += normal(random);
    return path;
  };
  t.corners.left = seen(left);
  t.corners.right = seen(right);
  if (plan.kind == trial::Experiment::robot) t.robot = trial::Robot{t.corners.time_s, right, right};
  trial::write_trial(t, folder / plan.name, images);
}

}  // namespace

trial::Campaign record_fabric(const Fabric& fabric, const TrialProtocol& protocol, const std::filesystem::path& folder,
                              const report::ProgressCallback& progress) {
  std::filesystem::remove_all(folder);
  std::mt19937_64 random(protocol.seed);
  trial::Campaign campaign;
  campaign.fabric = fabric.name;
  for (const TrialPlan& plan : protocol.trials) {
    record_trial(fabric, plan, protocol, folder, random);
    campaign.trials.emplace_back().name = plan.name;
    progress(static_cast<double>(campaign.trials.size()) / static_cast<double>(protocol.trials.size()),
             "recorded " + plan.name);
  }
  trial::write_campaign_json(campaign, folder);
  return trial::read_campaign(folder);
}

}  // namespace selvedge::experiments
