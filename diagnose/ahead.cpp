#include "diagnose/ahead.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/trial_error.h"
#include "estimate/robust_cost.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

double cut_rms_mm(const model::ObservedTrial& trial, const Protocol& protocol, std::vector<double> mm) {
  const auto count = static_cast<Index>(mm.size());
  if (count == 0) return std::numeric_limits<double>::quiet_NaN();
  const Eigen::Map<VectorXd> r(mm.data(), count);
  const double cut = protocol.sample_cut * estimate::robust_scale(r);
  return std::sqrt((trial.markers ? 3 : 1) * r.cwiseMax(-cut).cwiseMin(cut).squaredNorm() / static_cast<double>(count));
}

}  // namespace

MatrixXd ahead_mm(const model::Simulation& simulation, const model::State& state, const Protocol& protocol,
                  const std::vector<model::Parameter>& parameters, const MatrixXd& coordinates,
                  const std::vector<size_t>& trials) {
  const size_t count = simulation.trials().size();
  std::vector<size_t> wanted = trials;
  for (size_t trial = 0; trials.empty() && trial < count; ++trial) wanted.push_back(trial);
  std::vector<std::vector<double>> mm(count * static_cast<size_t>(coordinates.cols()));
  std::vector<bool> blew_up(static_cast<size_t>(coordinates.cols()), false);
  model::State held = state;
  held.grid_correction_mm.clear();
  for (size_t i = 0; i < count; ++i)
    held.nudging_per_s[i] = simulation.trials()[i].still ? 0 : protocol.ahead_nudging_per_s;
  for (const double first_s : {0.0, protocol.ahead_s}) {
    const cloth::LetGo let_go{protocol.ahead_s, first_s};
    held.let_go = let_go;
    const std::vector<model::Residuals> r = simulation.evaluate(held, parameters, coordinates, wanted);
    for (const size_t trial : wanted) {
      const model::ObservedTrial& t = simulation.trials()[trial];
      const VectorXd time_s = simulation.time_s(trial);
      for (size_t set = 0; set < r.size(); ++set) {
        blew_up[set] = blew_up[set] || !r[set].finite;
        const VectorXd& all = r[set].mm[trial];
        for (Index k = 0; k < all.size(); ++k)
          if (std::isfinite(all(k)) && (t.still || let_go.is_free(time_s(k) - t.experiment.start_s)))
            mm[trial * r.size() + set].push_back(all(k));
      }
    }
    std::erase_if(wanted, [&](size_t trial) { return simulation.trials()[trial].still; });
    if (wanted.empty()) break;
  }
  MatrixXd out =
      MatrixXd::Constant(coordinates.cols(), static_cast<Index>(count), std::numeric_limits<double>::quiet_NaN());
  for (size_t trial = 0; trial < count; ++trial)
    for (Index set = 0; set < coordinates.cols(); ++set)
      if (!blew_up[static_cast<size_t>(set)])
        out(set, static_cast<Index>(trial)) =
            cut_rms_mm(simulation.trials()[trial], protocol,
                       std::move(mm[trial * static_cast<size_t>(coordinates.cols()) + static_cast<size_t>(set)]));
  return out;
}

}  // namespace selvedge::diagnose
