#include "diagnose/measured.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace selvedge::diagnose {

using Eigen::Index;

namespace {

// One frame of a campaign that lost some counts as much as its share of all that was recorded in motion. What late
// stamps show is simulated, too.
std::vector<std::string> count_lost(std::vector<model::ObservedTrial>& trials) {
  std::vector<std::string> out;
  double all = 0, recorded_s = 0;
  for (const model::ObservedTrial& trial : trials) {
    if (!trial.markers || trial.still) continue;
    recorded_s += trial.markers->time_s.back() - trial.recorded_from_s;
    for (const observe::LostFrames& l : trial.markers->lost) all += l.count;
  }
  if (all == 0) return out;
  for (model::ObservedTrial& trial : trials) {
    if (!trial.markers || trial.still) continue;
    trial.lost_each_s = recorded_s / all;
    double late_s = 0;
    std::string at;
    for (const observe::LostFrames& l : trial.markers->lost) {
      late_s += l.count * (l.to_s - l.from_s);
      at += fmt::format("{}{:.3f} s", at.empty() ? "" : ", ", l.to_s);
    }
    if (at.empty()) continue;
    trial.experiment.sample_s = model::sample_times(trial.experiment.start_s, trial.markers->time_s.back() + late_s);
    out.push_back(
        fmt::format("{}: markers move as if frames were missing before {}; stamps have no gap", trial.name, at));
  }
  return out;
}

}  // namespace

Measured measure(std::vector<model::ObservedTrial>& trials, const Protocol& protocol) {
  Measured out;
  out.lost = count_lost(trials);
  out.delay = model::held_delay(trials, protocol.most_delay_s);
  double square = 0, held = 0;
  for (model::ObservedTrial& trial : trials) {
    cloth::HeldPath path = trial.experiment.path;
    for (double& t : path.time_s) t += out.delay ? out.delay->delay_s : 0;
    out.middle_m.push_back(0);
    out.ends_m.push_back(0);
    if (!model::is_outline_grid(trial)) continue;
    const model::Jumps jumps(trial, path);
    square += jumps.distance_m() * jumps.distance_m();
    ++held;
    out.middle_m.back() = jumps.middle_m();
    out.ends_m.back() = jumps.ends_m();
    trial.markers->noise_m = std::max(trial.markers->noise_m, jumps.noise_m());
  }
  out.held_m = held > 0 ? std::sqrt(square / held) : 0;
  return out;
}

FrameNoise frame_noise(const Measured& measured, const model::Simulation& simulation, const Windows& windows) {
  FrameNoise out;
  const bool any = std::any_of(measured.middle_m.begin(), measured.middle_m.end(), [](double m) { return m > 0; });
  out.shapes = Eigen::MatrixXd::Zero(windows.rows(), any ? 6 : 0);
  out.frame.assign(static_cast<size_t>(windows.rows()), 0);
  if (!any) return out;
  for (const Window& w : windows.windows()) {
    const model::ObservedTrial& trial = simulation.trials()[w.trial];
    if (measured.middle_m[w.trial] <= 0) continue;
    const auto times = static_cast<Index>(trial.markers->time_s.size());
    for (Index row = w.first; row < w.first + w.count; ++row) {
      const Index place = windows.place(row), marker = place / 3 / times, axis = place % 3;
      const Eigen::Vector2d& uv = trial.markers->uv[static_cast<size_t>(marker)];
      const double grows_mm = 1e3 * uv.y() / trial.height_m;
      out.frame[static_cast<size_t>(row)] = static_cast<int>(place / 3 % times);
      out.shapes(row, axis) = grows_mm * measured.middle_m[w.trial];
      out.shapes(row, 3 + axis) = grows_mm * measured.ends_m[w.trial] * (2 * uv.x() / trial.width_m - 1);
    }
  }
  return out;
}

}  // namespace selvedge::diagnose
