#include "hardware_sim/simulated_mocap/simulated_mocap.h"

#include <algorithm>

namespace selvedge::hardware_sim {

bool SimulatedMocap::chance(double probability) {
  return probability > 0 && std::bernoulli_distribution(probability)(random_);
}

// Disappearances begin at random and last an exponentially distributed time.
bool SimulatedMocap::hidden(const std::string& marker, double t) {
  if (options_.occlusions_per_s <= 0) return false;
  double& until_s = hidden_until_s_[marker];
  if (t >= until_s && chance(std::min(1.0, options_.occlusions_per_s / options_.rate_hz)))
    until_s = t + std::exponential_distribution<double>(1 / options_.occlusion_s)(random_);
  return t < until_s;
}

std::optional<std::vector<NamedPoint>> SimulatedMocap::see(std::vector<NamedPoint> points, double t) {
  if (points.size() >= 2 && chance(options_.swap_probability)) {
    std::swap(points[0].position_m, points[1].position_m);
    ++counts_.swaps;
  }
  std::normal_distribution<double> noise(0, options_.noise_m);
  std::vector<NamedPoint> seen;
  for (auto& point : points) {
    if (hidden(point.subject + "/" + point.name, t)) {
      ++counts_.markers_hidden;
      continue;
    }
    if (options_.noise_m > 0) point.position_m += Eigen::Vector3d(noise(random_), noise(random_), noise(random_));
    seen.push_back(point);
  }
  if (chance(options_.ghost_probability)) {
    std::uniform_real_distribution<double> anywhere(-1, 1);
    seen.push_back({"", "", {anywhere(random_), anywhere(random_), 1 + anywhere(random_)}});
    ++counts_.ghosts;
  }
  ++counts_.frames;
  if (!chance(options_.drop_probability)) return seen;
  ++counts_.frames_dropped;
  return std::nullopt;
}

double SimulatedMocap::leaves_at_s(double t) {
  double leaves_s = t + options_.latency_s;
  if (options_.jitter_s > 0) leaves_s += std::exponential_distribution<double>(1 / options_.jitter_s)(random_);
  return last_leaving_s_ = std::max(leaves_s, last_leaving_s_);
}

}  // namespace selvedge::hardware_sim
