#include "estimate/rows.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace selvedge::estimate {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kBlock_s = 0.2;
constexpr int kBlocksATrial = 100000;

bool has_rows(const RowOptions& options, size_t trial) {
  return options.trials.empty() ||
         std::find(options.trials.begin(), options.trials.end(), trial) != options.trials.end();
}

}  // namespace

Rows::Rows(const model::Simulation& simulation, const RowOptions& options) {
  std::vector<double> inverse_sd;
  for (size_t trial = 0; trial < simulation.trials().size(); ++trial) {
    if (!has_rows(options, trial)) continue;
    const VectorXd sd = simulation.sd_mm(trial), time_s = simulation.time_s(trial);
    for (Index i = 0; i < sd.size(); ++i) {
      if (!simulation.trials()[trial].still && time_s(i) > options.until_s) continue;
      place_.push_back({trial, i, static_cast<int>(trial) * kBlocksATrial + static_cast<int>(time_s(i) / kBlock_s)});
      inverse_sd.push_back(1 / sd(i));
    }
  }
  inverse_sd_ = Eigen::Map<const VectorXd>(inverse_sd.data(), static_cast<Index>(inverse_sd.size()));
}

VectorXd Rows::whitened(const model::Residuals& residuals) const {
  VectorXd out(size());
  for (Index row = 0; row < size(); ++row) {
    const Place& at = place_[static_cast<size_t>(row)];
    const VectorXd& mm = residuals.mm[at.trial];
    const double value = mm.size() ? mm(at.index) : std::numeric_limits<double>::quiet_NaN();
    out(row) = std::isfinite(value) ? value * inverse_sd_(row) : 0;
  }
  return out;
}

Eigen::MatrixXd Rows::whitened(const std::vector<model::Residuals>& sets) const {
  Eigen::MatrixXd out(size(), static_cast<Index>(sets.size()));
  for (Index k = 0; k < out.cols(); ++k) {
    if (sets[static_cast<size_t>(k)].finite) out.col(k) = whitened(sets[static_cast<size_t>(k)]);
    else out.col(k).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return out;
}

}  // namespace selvedge::estimate
