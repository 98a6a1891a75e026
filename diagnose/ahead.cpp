#include "diagnose/ahead.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnose/rows.h"
#include "fit/robust_cost.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kHold_per_s = 20;

double cut_rms_mm(const fit::ObservedTrial& trial, std::vector<double> mm) {
  const auto count = static_cast<Index>(mm.size());
  if (count == 0) return std::numeric_limits<double>::quiet_NaN();
  const Eigen::Map<VectorXd> r(mm.data(), count);
  const double cut = kSampleCut * fit::robust_scale(r);
  return std::sqrt((trial.markers ? 3 : 1) * r.cwiseMax(-cut).cwiseMin(cut).squaredNorm() / static_cast<double>(count));
}

}  // namespace

MatrixXd ahead_mm(const fit::Objective& objective, const std::vector<fit::Parameter>& parameters,
                  const MatrixXd& coordinates, const std::vector<size_t>& trials) {
  const size_t count = objective.scenes().size();
  std::vector<size_t> wanted = trials;
  for (size_t trial = 0; trials.empty() && trial < count; ++trial) wanted.push_back(trial);
  std::vector<double> pulls;
  for (const fit::Scene& scene : objective.scenes()) pulls.push_back(scene.trial.still ? 0 : kHold_per_s);
  std::vector<std::vector<double>> mm(count * static_cast<size_t>(coordinates.cols()));
  std::vector<bool> blew_up(static_cast<size_t>(coordinates.cols()), false);
  fit::Objective run = objective;
  run.set_mesh_correction({});
  run.set_pulls(pulls);
  for (const double first_s : {0.0, kAhead_s}) {
    const cloth::LetGo let_go{kAhead_s, first_s};
    run.set_let_go(let_go);
    const std::vector<fit::Residuals> r = run.evaluate(parameters, coordinates, wanted);
    for (const size_t trial : wanted) {
      const fit::ObservedTrial& t = objective.scenes()[trial].trial;
      const VectorXd time_s = objective.time_s(trial);
      for (size_t set = 0; set < r.size(); ++set) {
        blew_up[set] = blew_up[set] || !r[set].finite;
        const VectorXd& all = r[set].mm[trial];
        for (Index k = 0; k < all.size(); ++k)
          if (std::isfinite(all(k)) && (t.still || let_go.is_free(time_s(k) - t.experiment.start_s)))
            mm[trial * r.size() + set].push_back(all(k));
      }
    }
    std::erase_if(wanted, [&](size_t trial) { return objective.scenes()[trial].trial.still; });
    if (wanted.empty()) break;
  }
  MatrixXd out =
      MatrixXd::Constant(coordinates.cols(), static_cast<Index>(count), std::numeric_limits<double>::quiet_NaN());
  for (size_t trial = 0; trial < count; ++trial)
    for (Index set = 0; set < coordinates.cols(); ++set)
      if (!blew_up[static_cast<size_t>(set)])
        out(set, static_cast<Index>(trial)) =
            cut_rms_mm(objective.scenes()[trial].trial,
                       std::move(mm[trial * static_cast<size_t>(coordinates.cols()) + static_cast<size_t>(set)]));
  return out;
}

}  // namespace selvedge::diagnose
