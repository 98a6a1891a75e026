// What a simulated motion-capture system sees of the world, whatever wire it then goes over: markers with Gaussian
// noise, some of them hidden for a while, sometimes with swapped labels or with a ghost, now and then a frame lost.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace selvedge::hardware_sim {

struct NamedPoint {
  std::string subject;  // "fabric", "grid"; empty for an unlabelled marker
  std::string name;     // "left", "right", "g0_0"; empty for an unlabelled marker
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
};

struct MocapOptions {
  double rate_hz = 120;
  double noise_m = 0.2e-3;       // one standard deviation per axis
  double latency_s = 5e-3;       // exposure to sending
  double jitter_s = 0.3e-3;      // mean of the exponential delay on top, which nobody states
  double occlusions_per_s = 0;   // per marker, how often it disappears
  double occlusion_s = 0.05;     // mean length of a disappearance
  double drop_probability = 0;   // of a whole frame (its number is then missing)
  double swap_probability = 0;   // of a frame in which the first two markers carry each other's label
  double ghost_probability = 0;  // of a frame with one unlabelled marker that does not exist
  unsigned seed = 1;
};

struct MocapCounts {
  std::int64_t frames = 0, frames_dropped = 0, markers_hidden = 0, swaps = 0, ghosts = 0;
};

class SimulatedMocap {
 public:
  explicit SimulatedMocap(const MocapOptions& options) : options_(options), random_(options.seed) {}

  // What is seen of `points` at time t; none where the frame is lost.
  std::optional<std::vector<NamedPoint>> see(std::vector<NamedPoint> points, double t);
  // When a frame taken at t leaves: never before the one before it.
  double leaves_at_s(double t);
  const MocapCounts& counts() const { return counts_; }

 private:
  bool chance(double probability);
  bool hidden(const std::string& marker, double t);

  const MocapOptions options_;
  std::mt19937 random_;
  std::map<std::string, double> hidden_until_s_;
  double last_leaving_s_ = 0;
  MocapCounts counts_;
};

}  // namespace selvedge::hardware_sim
