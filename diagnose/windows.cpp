#include "diagnose/windows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

cloth::LetGo schedule(const Protocol& protocol, int phase) { return {protocol.free_s, phase * protocol.free_s}; }

double since_lead_s(const model::ObservedTrial& trial, double t_s) {
  return t_s - trial.experiment.start_s - trial.lead_s;
}

int turn_at(const Protocol& protocol, double since_s) {
  return static_cast<int>(std::floor(since_s / protocol.free_s + 1e-9));
}

// Which residuals of a trial are rows: of markers those that were seen; of pictures points so far apart that what
// a right model leaves of one tells nothing of the next.
std::vector<bool> rows_of(const model::ObservedTrial& trial, const Protocol& protocol) {
  std::vector<bool> out;
  if (trial.markers)
    for (Index k = 0; k < 3 * trial.markers->position.cols(); ++k)
      out.push_back(trial.markers->position.col(k / 3).allFinite());
  if (trial.stripes) {
    const std::vector<bool> points = observe::one_a_square(*trial.stripes, protocol.seen_apart * trial.width_m);
    out.insert(out.end(), points.begin(), points.end());
  }
  return out;
}

VectorXd noise_of(const model::Simulation& simulation, size_t trial) {
  const double floor = simulation.options().model_sd_mm;
  return (simulation.sd_mm(trial).array().square() - floor * floor).max(1e-6).sqrt();
}

}  // namespace

Windows::Windows(const model::Simulation& simulation, const Protocol& protocol) : protocol_(protocol) {
  struct Found {
    Window window;
    std::vector<Slice> slices;
    std::vector<double> noise_mm;
  };
  std::map<std::pair<size_t, int>, Found> found;  // by trial and turn
  for (size_t t = 0; t < simulation.trials().size(); ++t) {
    const model::ObservedTrial& trial = simulation.trials()[t];
    const VectorXd time_s = simulation.time_s(t), noise_mm = noise_of(simulation, t);
    const std::vector<bool> is_row = rows_of(trial, protocol);
    for (Index i = 0; i < time_s.size(); ++i) {
      if (!is_row[static_cast<size_t>(i)]) continue;
      const double since = since_lead_s(trial, time_s(i));
      if (since < -1e-9) continue;
      int turn = 0, phase = 0;
      if (is_held(trial)) {
        turn = turn_at(protocol, since);
        phase = phase_at(trial, time_s(i));
      } else if (!trial.still) {
        turn = static_cast<int>(std::floor(since / protocol.image_window_s));
      }
      Found& f = found[{t, turn}];
      if (f.slices.empty()) f.window = {t, time_s(i), time_s(i), 0, 0};
      f.window.from_s = std::min(f.window.from_s, time_s(i));
      f.window.to_s = std::max(f.window.to_s, time_s(i));
      f.slices.push_back({i, t, phase});
      f.noise_mm.push_back(noise_mm(i));
    }
  }
  std::vector<double> noise_mm;
  for (auto& [key, f] : found) {
    f.window.first = rows();
    f.window.count = static_cast<Index>(f.slices.size());
    windows_.push_back(f.window);
    slices_.insert(slices_.end(), f.slices.begin(), f.slices.end());
    noise_mm.insert(noise_mm.end(), f.noise_mm.begin(), f.noise_mm.end());
  }
  noise_mm_ = Eigen::Map<VectorXd>(noise_mm.data(), static_cast<Index>(noise_mm.size()));
}

model::State Windows::held(const model::Simulation& simulation, const model::State& state, int phase) const {
  model::State out = state;
  out.grid_correction_mm.clear();
  for (size_t t = 0; t < simulation.trials().size(); ++t)
    out.nudging_per_s[t] = is_held(simulation.trials()[t]) ? protocol_.hold_per_s : 0;
  out.let_go = schedule(protocol_, phase);
  return out;
}

int Windows::phase_at(const model::ObservedTrial& trial, double t_s) const {
  if (!is_held(trial)) return 0;
  const int turn = turn_at(protocol_, since_lead_s(trial, t_s));
  return ((turn % kPhases) + kPhases) % kPhases;
}

MatrixXd Windows::residuals(const model::Simulation& simulation, const model::State& state,
                            const std::vector<model::Parameter>& parameters, const MatrixXd& coordinates) const {
  MatrixXd out = MatrixXd::Constant(rows(), coordinates.cols(), std::numeric_limits<double>::quiet_NaN());
  std::vector<model::Asked> asked;
  std::array<size_t, kPhases> place{};  // of each phase, in these
  for (int phase = 0; phase < kPhases; ++phase) {
    std::vector<size_t> trials;
    for (size_t t = 0; t < simulation.trials().size(); ++t)
      if (std::any_of(slices_.begin(), slices_.end(), [&](const Slice& s) { return s.trial == t && s.phase == phase; }))
        trials.push_back(t);
    place[static_cast<size_t>(phase)] = asked.size();
    if (!trials.empty()) asked.push_back({held(simulation, state, phase), trials});
  }
  const std::vector<std::vector<model::Residuals>> runs = simulation.evaluate(asked, parameters, coordinates);
  for (Index row = 0; row < rows(); ++row) {
    const Slice& s = slices_[static_cast<size_t>(row)];
    const std::vector<model::Residuals>& free = runs[place[static_cast<size_t>(s.phase)]];
    for (size_t set = 0; set < free.size(); ++set)
      if (const VectorXd& mm = free[set].mm[s.trial]; mm.size() > 0) out(row, static_cast<Index>(set)) = mm(s.place);
  }
  return out;
}

}  // namespace selvedge::diagnose
