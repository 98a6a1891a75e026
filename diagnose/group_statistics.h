// What groups of trials say of a figure: intervals by leaving out one at a time, and whether it lies above zero.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

namespace selvedge::diagnose {

// 0 to groups − 1.
std::vector<size_t> all_groups(size_t groups);

// Standard deviation of a figure by the jackknife. without: the figure with each group left out.
double jackknife_sd(const Eigen::VectorXd& without);

// Half of a figure's 90 % interval by the jackknife; NaN where there is but one group. figure: of some groups.
double half_interval(size_t groups, const std::function<double(const std::vector<size_t>&)>& figure);

// How likely a figure that is `is` is found so low, by its 90 % interval by the jackknife: one-sided t test; 1 where
// there is no interval.
double p_so_low(double found, double half_interval, size_t groups, double is);

// How likely values that scatter about zero are to lie so far above it: one-sided t test; 1 where there are too few.
double p_above_zero(const std::vector<double>& values);

// The least factor by which such a p lowers the odds of what it was computed for, whatever else may be so: −e p ln p, 1
// above 1/e (Sellke, Bayarri and Berger 2001).
double least_factor(double p);

}  // namespace selvedge::diagnose
