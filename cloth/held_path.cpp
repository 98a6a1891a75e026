#include "cloth/held_path.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>

namespace selvedge::cloth {

namespace {

using Sparse = Eigen::SparseMatrix<double>;

// Hermite basis on [time[i], time[i+1]].
struct Segment {
  size_t index = 0;
  double share = 0, length = 1;
};

Segment find_segment(const std::vector<double>& time, double t) {
  const auto after = std::upper_bound(time.begin(), time.end(), t);
  const size_t i =
      std::min(static_cast<size_t>(std::max<std::ptrdiff_t>(after - time.begin() - 1, 0)), time.size() - 2);
  const double length = time[i + 1] - time[i];
  return {i, std::clamp((t - time[i]) / length, 0.0, 1.0), length};
}

Eigen::Vector3d hermite(const Eigen::Matrix3Xd& p, const Eigen::Matrix3Xd& m, const Segment& s) {
  const double x = s.share, x2 = x * x, x3 = x2 * x;
  const auto i = static_cast<Eigen::Index>(s.index);
  return (2 * x3 - 3 * x2 + 1) * p.col(i) + (x3 - 2 * x2 + x) * s.length * m.col(i) + (3 * x2 - 2 * x3) * p.col(i + 1) +
         (x3 - x2) * s.length * m.col(i + 1);
}

Eigen::Vector3d hermite_rate(const Eigen::Matrix3Xd& p, const Eigen::Matrix3Xd& m, const Segment& s) {
  const double x = s.share, x2 = x * x;
  const auto i = static_cast<Eigen::Index>(s.index);
  return (6 * x2 - 6 * x) / s.length * (p.col(i) - p.col(i + 1)) + (3 * x2 - 4 * x + 1) * m.col(i) +
         (3 * x2 - 2 * x) * m.col(i + 1);
}

// Slopes of the natural cubic spline through p: one tridiagonal system for the three axes.
Eigen::Matrix3Xd spline_slopes(const std::vector<double>& time, const Eigen::Matrix3Xd& p) {
  const auto n = static_cast<Eigen::Index>(time.size());
  if (n < 2) return Eigen::Matrix3Xd::Zero(3, n);
  std::vector<double> diagonal(static_cast<size_t>(n)), upper(static_cast<size_t>(n));
  Eigen::Matrix3Xd right(3, n);
  const auto dt = [&](Eigen::Index i) { return time[static_cast<size_t>(i) + 1] - time[static_cast<size_t>(i)]; };
  const auto rise = [&](Eigen::Index i) -> Eigen::Vector3d { return (p.col(i + 1) - p.col(i)) / dt(i); };
  // Thomas elimination row by row; rows of the slope form: m_{i−1}/h_{i−1} + 2(1/h_{i−1}+1/h_i) m_i + m_{i+1}/h_i.
  for (Eigen::Index i = 0; i < n; ++i) {
    const double a = i > 0 ? 1 / dt(i - 1) : 0, c = i + 1 < n ? 1 / dt(i) : 0;
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    if (i > 0) b += 3 * a * rise(i - 1);
    if (i + 1 < n) b += 3 * c * rise(i);
    double d = 2 * (a + c);
    if (i > 0) {
      const double factor = a / diagonal[static_cast<size_t>(i) - 1];
      d -= factor * upper[static_cast<size_t>(i) - 1];
      b -= factor * right.col(i - 1);
    }
    diagonal[static_cast<size_t>(i)] = d;
    upper[static_cast<size_t>(i)] = c;
    right.col(i) = b;
  }
  Eigen::Matrix3Xd slope(3, n);
  for (Eigen::Index i = n - 1; i >= 0; --i) {
    slope.col(i) = right.col(i);
    if (i + 1 < n) slope.col(i) -= upper[static_cast<size_t>(i)] * slope.col(i + 1);
    slope.col(i) /= diagonal[static_cast<size_t>(i)];
  }
  return slope;
}

Sparse third_differences(Eigen::Index n) {
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index i = 0; i + 3 < n; ++i) {
    const double row[4] = {-1, 3, -3, 1};
    for (int k = 0; k < 4; ++k) entries.emplace_back(i, i + k, row[k]);
  }
  Sparse d(std::max<Eigen::Index>(n - 3, 0), n);
  d.setFromTriplets(entries.begin(), entries.end());
  return d;
}

// As many regular times as there are samples, from the first to the last.
std::vector<double> regular_times(const std::vector<double>& time_s) {
  std::vector<double> regular(time_s.size());
  const double step = (time_s.back() - time_s.front()) / static_cast<double>(time_s.size() - 1);
  for (size_t i = 0; i < regular.size(); ++i) regular[i] = time_s.front() + static_cast<double>(i) * step;
  return regular;
}

// Values at the seen samples from values at regular times: Lagrange's cubic through the four nearest of these.
Sparse cubic_interpolation(const std::vector<double>& time_s, const std::vector<size_t>& seen) {
  const auto n = static_cast<Eigen::Index>(time_s.size());
  const double step = (time_s.back() - time_s.front()) / static_cast<double>(n - 1);
  std::vector<Eigen::Triplet<double>> entries;
  for (size_t row = 0; row < seen.size(); ++row) {
    const double at = (time_s[seen[row]] - time_s.front()) / step;
    const auto first = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(std::floor(at)) - 1, 0, n - 4);
    for (int k = 0; k < 4; ++k) {
      double weight = 1;
      for (int j = 0; j < 4; ++j)
        if (j != k) weight *= (at - static_cast<double>(first + j)) / (k - j);
      entries.emplace_back(static_cast<Eigen::Index>(row), first + k, weight);
    }
  }
  Sparse interpolation(static_cast<Eigen::Index>(seen.size()), n);
  interpolation.setFromTriplets(entries.begin(), entries.end());
  return interpolation;
}

// Effective degrees of freedom tr((AᵀA + λDᵀD)⁻¹AᵀA) by Hutchinson's estimate with fixed signs.
double degrees_of_freedom(const Eigen::SimplicialLDLT<Sparse>& solver, const Sparse& information) {
  double sum = 0;
  unsigned state = 12345;
  const int probes = 8;
  for (int k = 0; k < probes; ++k) {
    Eigen::VectorXd z(information.rows());
    for (Eigen::Index i = 0; i < z.size(); ++i) {
      state = state * 1664525u + 1013904223u;
      z(i) = (state >> 16 & 1u) ? 1 : -1;
    }
    sum += z.dot(solver.solve(information * z));
  }
  return sum / probes;
}

// Positions at regular_times(time_s): penalised least squares against the seen samples.
Eigen::Matrix3Xd smooth_corner(const std::vector<double>& time_s, const Eigen::Matrix3Xd& recorded) {
  const Eigen::Index n = recorded.cols();
  std::vector<size_t> seen;
  for (Eigen::Index i = 0; i < n; ++i)
    if (recorded.col(i).allFinite()) seen.push_back(static_cast<size_t>(i));
  if (seen.size() < 4) throw std::invalid_argument("smooth_path: a held corner is seen in fewer than four samples");
  Eigen::MatrixX3d values(static_cast<Eigen::Index>(seen.size()), 3);
  for (size_t row = 0; row < seen.size(); ++row)
    values.row(static_cast<Eigen::Index>(row)) = recorded.col(static_cast<Eigen::Index>(seen[row])).transpose();
  const auto count = static_cast<double>(seen.size());

  const Sparse interpolation = cubic_interpolation(time_s, seen), d = third_differences(n), penalty = d.transpose() * d;
  const Sparse information = interpolation.transpose() * interpolation;
  Sparse ridge(n, n);
  ridge.setIdentity();
  ridge *= 1e-12;

  Eigen::MatrixX3d best;
  double best_score = std::numeric_limits<double>::infinity();
  Eigen::SimplicialLDLT<Sparse> solver;
  solver.analyzePattern(information + ridge + penalty);
  for (double exponent = -1; exponent <= 7; exponent += 0.5) {
    solver.factorize(information + ridge + std::pow(10.0, exponent) * penalty);
    if (solver.info() != Eigen::Success) continue;
    const Eigen::MatrixX3d fit = solver.solve(interpolation.transpose() * values);
    const double misfit = (interpolation * fit - values).squaredNorm();
    const double freedom = std::min(degrees_of_freedom(solver, information), count - 1);
    const double score = misfit / std::pow(1 - freedom / count, 2);
    if (score < best_score) {
      best_score = score;
      best = fit;
    }
  }
  return best.transpose();
}

Eigen::Vector3d robust_mean(const Eigen::Matrix3Xd& recorded) {
  Eigen::Vector3d mean;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> seen;
    for (Eigen::Index i = 0; i < recorded.cols(); ++i)
      if (recorded.col(i).allFinite()) seen.push_back(recorded(axis, i));
    if (seen.empty()) throw std::invalid_argument("smooth_path: a held corner is never seen");
    std::sort(seen.begin(), seen.end());
    const size_t cut = seen.size() / 10;  // trimmed mean
    double sum = 0;
    for (size_t i = cut; i < seen.size() - cut; ++i) sum += seen[i];
    mean(axis) = sum / static_cast<double>(seen.size() - 2 * cut);
  }
  return mean;
}

}  // namespace

Eigen::Matrix<double, 3, 2> HeldPath::at(double t_s) const {
  Eigen::Matrix<double, 3, 2> result;
  if (time_s.size() < 2) {
    result << left.col(0), right.col(0);
    return result;
  }
  const Segment s = find_segment(time_s, t_s);
  result << hermite(left, left_slope, s), hermite(right, right_slope, s);
  return result;
}

Eigen::Matrix<double, 3, 2> HeldPath::velocity_at(double t_s) const {
  Eigen::Matrix<double, 3, 2> result = Eigen::Matrix<double, 3, 2>::Zero();
  if (time_s.size() < 2 || t_s < time_s.front() || t_s > time_s.back()) return result;
  const Segment s = find_segment(time_s, t_s);
  result << hermite_rate(left, left_slope, s), hermite_rate(right, right_slope, s);
  return result;
}

HeldPath make_path(Hold hold, const std::vector<double>& time_s, const Eigen::Matrix3Xd& left,
                   const Eigen::Matrix3Xd& right) {
  HeldPath path;
  path.hold = hold;
  path.time_s = time_s;
  path.left = left;
  path.right = right;
  path.left_slope = spline_slopes(time_s, left);
  path.right_slope = spline_slopes(time_s, right);
  return path;
}

HeldPath smooth_path(Hold hold, const std::vector<double>& time_s, const Eigen::Matrix3Xd& left,
                     const Eigen::Matrix3Xd& right, bool still) {
  if (still) return make_path(hold, {time_s.front()}, robust_mean(left), robust_mean(right));
  return make_path(hold, regular_times(time_s), smooth_corner(time_s, left), smooth_corner(time_s, right));
}

}  // namespace selvedge::cloth
