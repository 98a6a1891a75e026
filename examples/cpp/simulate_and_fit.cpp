// Simulates a swatch that is waved, takes dots on it for a recording, and fits that: what comes out is what went in.
// Prints the fitted parameters; exit status 1 where stretch or drag is off by more than a fifth.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "capture/trial/trial.h"
#include "cloth/spline/simulate.h"
#include "files/bad_input.h"
#include "fit/fit_campaign.h"

namespace {

using namespace selvedge;

constexpr double kWidth_m = 0.3, kNoise_m = 2e-4;

cloth::Material true_fabric() {
  cloth::Material m;
  m.density = 0.16;  // kg/m²
  m.stretch = 90;    // N/m
  m.shear = 45;
  m.bend = 8e-5;        // N·m
  m.drag_normal = 1.3;  // kg/m³
  return m;
}

// The right corner goes forth and back; amplitude 0: the sheet hangs still.
cloth::HeldPath path(double amplitude_m, int samples) {
  std::vector<double> time_s;
  Eigen::Matrix3Xd left(3, samples), right(3, samples);
  for (int i = 0; i < samples; ++i) {
    time_s.push_back(i / 120.0);
    const double y = amplitude_m * 0.5 * (1 - std::cos(2 * M_PI * 1.5 * time_s.back()));
    left.col(i) << -0.12, 0, 0;
    right.col(i) << 0.12, y, 0.3 * y;
  }
  return cloth::make_path(cloth::Hold::corners, time_s, left, right);
}

trial::Trial recorded(const std::string& name, double amplitude_m, int samples, unsigned seed) {
  const cloth::spline::Swatch swatch{kWidth_m, kWidth_m};
  const auto sheet = make_spline_sheet(swatch, make_grid(swatch, cloth::Hold::corners, kWidth_m / 9));
  cloth::Experiment e;
  e.material = true_fabric();
  e.path = path(amplitude_m, samples);
  e.sample_s = e.path.time_s;
  e.start_shape = hung_shape(sheet, e, 1);
  const cloth::Trajectory motion = cloth::spline::simulate(sheet, {e}).front();

  std::mt19937 generator(seed);
  std::normal_distribution<double> noise(0, kNoise_m);
  trial::Trial t;
  t.name = name;
  t.experiment = amplitude_m > 0 ? trial::Experiment::waving : trial::Experiment::static_hang;
  t.fabric = {"simulated", kWidth_m, kWidth_m, e.material.density * kWidth_m * kWidth_m, true};
  t.starts_at_rest = true;
  t.mocap_rate_hz = 120;
  t.mocap_noise_m = kNoise_m;
  t.corners = {e.path.time_s, e.path.left, e.path.right};
  trial::Markers dots;
  dots.position.resize(3, 25 * samples);
  for (int i = 0; i < samples; ++i)
    for (int k = 0; k < 25; ++k) {
      dots.time_s.push_back(e.path.time_s[static_cast<size_t>(i)]);
      dots.marker.push_back(k);
      dots.uv.emplace_back(0.03 + 0.06 * (k % 5), 0.03 + 0.06 * (k / 5));
      const auto point = surface_point(sheet, dots.uv.back());
      dots.position.col(25 * i + k) = position_of(point, motion.samples[static_cast<size_t>(i)]) +
                                      Eigen::Vector3d(noise(generator), noise(generator), noise(generator));
    }
  t.markers = dots;
  return t;
}

}  // namespace

int main() {
  trial::Campaign campaign;
  campaign.folder = campaign.fabric = "simulated";
  campaign.trials = {recorded("static-1", 0, 12, 1), recorded("waving-1", 0.09, 96, 2)};
  fit::FitOptions options;
  options.cells = 9;
  options.max_iterations = 6;
  try {
    const fit::FitOutcome found = fit::fit_campaign(campaign, options);
    double worst = 0;
    for (const fit::FittedParameter& p : found.parameters) {
      std::printf("%-16s %10.4g %-10s (%.3g to %.3g)\n", p.parameter.name.c_str(), p.value, p.parameter.unit.c_str(),
                  p.lower_interval, p.upper_interval);
      if (p.parameter.name == "stretch") worst = std::max(worst, std::abs(p.value / true_fabric().stretch - 1));
      if (p.parameter.name == "drag_normal") worst = std::max(worst, std::abs(p.value / true_fabric().drag_normal - 1));
    }
    return worst < 0.2 ? EXIT_SUCCESS : EXIT_FAILURE;
  } catch (const BadInput& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
