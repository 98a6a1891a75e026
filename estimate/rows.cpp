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

bool was_seen(const model::Simulation& simulation, size_t trial, Index index) {
  const auto& markers = simulation.trials()[trial].markers;
  return !markers || index / 3 >= markers->position.cols() || markers->position.col(index / 3).allFinite();
}

}  // namespace

Rows::Rows(const model::Simulation& simulation, const RowOptions& options) {
  std::vector<double> inverse_sd, sd_mm, seen;
  offset_.push_back(0);
  for (size_t trial = 0; trial < simulation.trials().size(); ++trial) {
    const bool still = simulation.trials()[trial].still;
    if (has_rows(options, trial)) {
      const VectorXd sd = simulation.sd_mm(trial), time_s = simulation.time_s(trial);
      for (Index i = 0; i < sd.size(); ++i) {
        if (!still && time_s(i) > options.until_s) continue;
        place_.push_back({trial, i, static_cast<int>(trial) * kBlocksATrial + static_cast<int>(time_s(i) / kBlock_s)});
        inverse_sd.push_back((still ? std::sqrt(options.still_samples) : 1) / sd(i));
        sd_mm.push_back(sd(i));
        seen.push_back(was_seen(simulation, trial, i) ? 1 : 0);
      }
    }
    offset_.push_back(static_cast<Index>(place_.size()));
  }
  const auto column = [](const std::vector<double>& v) {
    return VectorXd(Eigen::Map<const VectorXd>(v.data(), static_cast<Index>(v.size())));
  };
  inverse_sd_ = column(inverse_sd);
  sd_mm_ = column(sd_mm);
  seen_ = column(seen);
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
