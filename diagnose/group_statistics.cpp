#include "diagnose/group_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <boost/math/distributions/students_t.hpp>

namespace selvedge::diagnose {

using boost::math::students_t;
using Eigen::Index;
using Eigen::VectorXd;

std::vector<size_t> all_groups(size_t groups) {
  std::vector<size_t> all(groups);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

double jackknife_sd(const VectorXd& without) {
  const auto n = static_cast<double>(without.size());
  return n < 2 ? 0 : std::sqrt((n - 1) / n * (without.array() - without.mean()).square().sum());
}

double half_interval(size_t groups, const std::function<double(const std::vector<size_t>&)>& figure) {
  if (groups < 2) return std::numeric_limits<double>::quiet_NaN();
  VectorXd without(static_cast<Index>(groups));
  for (size_t g = 0; g < groups; ++g) {
    std::vector<size_t> rest = all_groups(groups);
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(g));
    without(static_cast<Index>(g)) = figure(rest);
  }
  return quantile(students_t(static_cast<double>(groups - 1)), 0.95) * jackknife_sd(without);
}

double p_so_low(double found, double half_interval, size_t groups, double is) {
  if (groups < 2 || !(half_interval > 0)) return 1;
  const students_t t(static_cast<double>(groups - 1));
  return cdf(complement(t, (is - found) / half_interval * quantile(t, 0.95)));
}

double p_above_zero(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  if (n < 2) return 1;
  double mean = 0, square = 0;
  for (const double v : values) mean += v / n;
  for (const double v : values) square += (v - mean) * (v - mean);
  const double sd = std::sqrt(square / (n - 1));
  if (!(sd > 0)) return 1;
  return cdf(complement(students_t(n - 1), mean / (sd / std::sqrt(n))));
}

double least_factor(double p) {
  const double e = std::exp(1.0), least = std::max(p, 1e-12);
  return p < 1 / e ? -e * least * std::log(least) : 1;
}

}  // namespace selvedge::diagnose
