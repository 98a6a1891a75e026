#include "model/trial_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <boost/math/distributions/students_t.hpp>

#include "model/held_markers.h"

namespace selvedge::model {

using Eigen::Index;

double rms_mm(const ObservedTrial& trial, const Eigen::VectorXd& residual, const Eigen::VectorXd& time_s, double from_s,
              double to_s) {
  double sum = 0;
  Index count = 0;
  for (Index i = 0; i < residual.size(); ++i)
    if (std::isfinite(residual(i)) && time_s(i) >= from_s && time_s(i) <= to_s) {
      sum += residual(i) * residual(i);
      ++count;
    }
  if (count == 0) return std::numeric_limits<double>::quiet_NaN();
  return std::sqrt((trial.markers ? 3.0 : 1.0) * sum / static_cast<double>(count));
}

double first_move_s(const ObservedTrial& trial) {
  constexpr double kMoved_m = 1e-3;
  const cloth::Experiment& e = trial.experiment;
  const Eigen::Matrix<double, 3, 2> begin = e.path.at(e.start_s);
  for (const double t : e.sample_s)
    if ((e.path.at(t) - begin).colwise().norm().maxCoeff() > kMoved_m) return t;
  return std::numeric_limits<double>::quiet_NaN();
}

std::optional<Interval> rms_interval_mm(const ObservedTrial& trial, const Eigen::VectorXd& residual,
                                        const Eigen::VectorXd& time_s, double from_s, double to_s) {
  constexpr double kBlock_s = 1;
  constexpr size_t kLeastBlocks = 4;
  struct Block {
    double sum = 0, count = 0;
  };
  std::map<int, Block> blocks;
  double sum = 0, count = 0;
  for (Index i = 0; i < residual.size(); ++i)
    if (std::isfinite(residual(i)) && time_s(i) >= from_s && time_s(i) <= to_s) {
      Block& b = blocks[static_cast<int>(std::floor(time_s(i) / kBlock_s))];
      b.sum += residual(i) * residual(i);
      b.count += 1;
      sum += residual(i) * residual(i);
      count += 1;
    }
  if (blocks.size() < kLeastBlocks) return std::nullopt;
  // A ratio of sums, its variance from how the blocks depart from it.
  const double mean = sum / count, n = static_cast<double>(blocks.size());
  double departed = 0;
  for (const auto& [at, b] : blocks) departed += std::pow(b.sum - mean * b.count, 2);
  const double half =
      boost::math::quantile(boost::math::students_t(n - 1), 0.95) * std::sqrt(n / (n - 1) * departed) / count;
  const double rows = trial.markers ? 3 : 1;
  return Interval{std::sqrt(rows * std::max(0.0, mean - half)), std::sqrt(rows * (mean + half))};
}

std::optional<double> rms_in_noise(const ObservedTrial& trial, const Eigen::VectorXd& residual,
                                   const Eigen::VectorXd& time_s, double from_s) {
  if (!trial.markers || residual.size() == 0) return std::nullopt;
  const std::vector<double> noise_m = marker_noise_m(trial);
  const auto rows = static_cast<Index>(3 * trial.markers->time_s.size());
  double sum = 0, count = 0;
  for (Index i = 0; i < residual.size(); ++i) {
    if (!std::isfinite(residual(i)) || time_s(i) < from_s) continue;
    const double deviations = residual(i) / (1e3 * noise_m[static_cast<size_t>(i / rows)]);
    sum += deviations * deviations;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return std::sqrt(sum / count);
}

}  // namespace selvedge::model
