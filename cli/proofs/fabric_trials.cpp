#include "cli/proofs/fabric_trials.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Geometry>

#include "capture/trial/trial_writer.h"
#include "cloth/simulate.h"
#include "render/stripe_renderer.h"

namespace selvedge::cli {

namespace {

constexpr double kRecorded_m = 0.3, kTracker_hz = 120;

TrueFabric made_fabric(const std::string& name, double density, double stretch, double shear, double bend, double bend_damping, double drag) {
  cloth::Material m;
  m.density = density;
  m.stretch = stretch;
  m.shear = shear;
  m.bend = bend;
  m.bend_damping = bend_damping;
  m.drag_normal = drag;
  return {name, m};
}

// Between the two held corners at a time; the right one waves, after a short rest.
struct HandMotion {
  std::string name;
  double apart_m = 0, amplitude_m = 0, frequency_hz = 0;
  Eigen::Vector3d right(double t) const {
    const double w = amplitude_m == 0 || t < 0.1 ? 0 : 0.5 * (1 - std::cos(2 * M_PI * frequency_hz * (t - 0.1)));
    return {apart_m / 2, amplitude_m * w, 0.4 * amplitude_m * w};
  }
};

trial::GreyImage with_noise(render::Image image, double sd, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0, sd);
  trial::GreyImage out(image.rows(), image.cols());
  for (Eigen::Index i = 0; i < image.size(); ++i)
    out(i) = static_cast<unsigned char>(std::clamp(std::lround(image(i) + normal(random)), 0L, 255L));
  return out;
}

trial::Trial blank_trial(const TrueFabric& fabric, const HandMotion& motion, const FabricTrialOptions& options) {
  trial::Trial t;
  t.name = motion.name;
  t.experiment = motion.amplitude_m > 0 ? trial::Experiment::waving : trial::Experiment::static_hang;
  t.fabric = {fabric.name, kRecorded_m, kRecorded_m, fabric.material.density * kRecorded_m * kRecorded_m, true};
  t.starts_at_rest = true;
  const Eigen::Vector3d middle(0, 0.02, -0.15);
  t.camera = geometry::looking_at({0.05, -1.0, -0.1}, middle, 880, 640, 480);
  t.projector = geometry::looking_at({-0.1, -0.95, 0.4}, middle, 1450, 1024, 768);
  t.pattern = trial::StripePattern{"horizontal", 16, 0.5, 0};
  t.frame_rate_hz = options.frame_rate_hz;
  t.mocap_rate_hz = kTracker_hz;
  t.mocap_noise_m = options.noise_m;
  t.noise_grey_levels = options.noise_grey;
  return t;
}

trial::Trial record_trial(const TrueFabric& fabric, const HandMotion& motion, const std::filesystem::path& folder,
                          const FabricTrialOptions& options, std::mt19937_64& random) {
  trial::Trial t = blank_trial(fabric, motion, options);
  const int frames = motion.amplitude_m > 0 ? options.frames : 1;
  const int samples = static_cast<int>(frames * kTracker_hz / options.frame_rate_hz) + 12;
  Eigen::Matrix3Xd left(3, samples), right(3, samples);
  for (int i = 0; i < samples; ++i) {
    t.corners.time_s.push_back(i / kTracker_hz);
    left.col(i) = Eigen::Vector3d(-motion.apart_m / 2, 0, 0);
    right.col(i) = motion.right(i / kTracker_hz);
  }
  const cloth::Sheet sheet = cloth::make_sheet(geometry::make_grid_mesh(kRecorded_m, kRecorded_m, options.columns, options.columns));
  cloth::Experiment e;
  e.material = fabric.material;
  e.path = cloth::make_path(cloth::Hold::corners, t.corners.time_s, left, right);
  e.start_shape = cloth::hung_shape(sheet, e, 1);
  t.frames.emplace();
  for (int k = 0; k < frames; ++k) {
    t.frames->number.push_back(k);
    t.frames->time_s.push_back(k / options.frame_rate_hz);
  }
  e.sample_s = t.frames->time_s;
  const cloth::Trajectory run = cloth::simulate(sheet, {e}).front();

  render::StripeRenderer renderer(*t.camera, *t.projector);
  renderer.set_pattern({true, t.pattern->period_px, t.pattern->duty, t.pattern->first_bright_row_px});
  std::vector<trial::GreyImage> images;
  for (const Eigen::Matrix3Xd& shape : run.samples) images.push_back(with_noise(renderer.render(shape, sheet.mesh.triangles), options.noise_grey, random));
  std::normal_distribution<double> normal(0, options.noise_m);
  const auto seen = [&](Eigen::Matrix3Xd path) {
    for (Eigen::Index i = 0; i < path.size(); ++i) path(i) += normal(random);
    return path;
  };
  t.corners.left = seen(left);
  t.corners.right = seen(right);
  trial::write_trial(t, folder / motion.name, images);
  return t;
}

}  // namespace

const std::vector<TrueFabric>& true_fabrics() {
  static const std::vector<TrueFabric> list = {
      made_fabric("linen", 0.20, 900, 300, 4e-4, 2e-6, 1.2),
      made_fabric("fleece", 0.26, 200, 110, 1.5e-4, 1e-6, 1.6),
      made_fabric("satin", 0.12, 350, 120, 1.5e-5, 2e-7, 0.9),
      made_fabric("knit", 0.17, 70, 40, 4e-5, 5e-7, 1.2),
  };
  return list;
}

trial::Campaign record_fabric(const TrueFabric& fabric, const std::filesystem::path& folder, const FabricTrialOptions& options) {
  std::mt19937_64 random(options.seed);
  trial::Campaign campaign;
  campaign.fabric = fabric.name;
  for (const HandMotion& motion : {HandMotion{"static-1", 0.295, 0, 0}, HandMotion{"static-2", 0.285, 0, 0}, HandMotion{"waving-1", 0.29, 0.06, 1.2},
                                   HandMotion{"waving-2", 0.29, 0.045, 1.7}})
    campaign.trials.push_back(record_trial(fabric, motion, folder, options, random));
  trial::write_campaign_json(campaign, folder);
  return trial::read_campaign(folder);
}

}  // namespace selvedge::cli
