#include "calib/linear_projection.h"

#include <cmath>
#include <numeric>
#include <random>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace selvedge::calib {

namespace {

using Points = std::vector<Eigen::Vector3d>;
using Pixels = std::vector<Eigen::Vector2d>;
using Matrix34 = Eigen::Matrix<double, 3, 4>;

// Moves to the mean and scales to the mean distance √dimension.
template <int dimension>
Eigen::Matrix<double, dimension + 1, dimension + 1> normaliser(
    const std::vector<Eigen::Matrix<double, dimension, 1>>& all, const std::vector<int>& chosen) {
  Eigen::Matrix<double, dimension, 1> mean = Eigen::Matrix<double, dimension, 1>::Zero();
  for (const int i : chosen) mean += all[i];
  mean /= static_cast<double>(chosen.size());
  double distance = 0;
  for (const int i : chosen) distance += (all[i] - mean).norm();
  distance /= static_cast<double>(chosen.size());
  const double scale = distance > 0 ? std::sqrt(static_cast<double>(dimension)) / distance : 1;
  Eigen::Matrix<double, dimension + 1, dimension + 1> transform;
  transform.setIdentity();
  transform.template topLeftCorner<dimension, dimension>() *= scale;
  transform.template topRightCorner<dimension, 1>() = -scale * mean;
  return transform;
}

struct Solution {
  Matrix34 matrix;
  double singular_ratio = 1;
};

Solution solve(const Points& points, const Pixels& pixels, const std::vector<int>& chosen) {
  const Eigen::Matrix4d to_unit_point = normaliser<3>(points, chosen);
  const Eigen::Matrix3d to_unit_pixel = normaliser<2>(pixels, chosen);
  Eigen::Matrix<double, 12, 12> normal = Eigen::Matrix<double, 12, 12>::Zero();
  for (const int i : chosen) {
    const Eigen::Vector4d x = to_unit_point * points[i].homogeneous();
    const Eigen::Vector3d u = to_unit_pixel * pixels[i].homogeneous();
    Eigen::Matrix<double, 2, 12> rows;
    rows << x.transpose(), Eigen::RowVector4d::Zero(), -u.x() * x.transpose(), Eigen::RowVector4d::Zero(),
        x.transpose(), -u.y() * x.transpose();
    normal.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 12, 12>> eigen(normal);
  Matrix34 unit;
  for (int row = 0; row < 3; ++row) unit.row(row) = eigen.eigenvectors().col(0).segment<4>(4 * row).transpose();
  Solution solution;
  solution.matrix = to_unit_pixel.inverse() * unit * to_unit_point;
  // Points in front must come out with a positive third coordinate.
  double side = 0;
  for (const int i : chosen) side += (solution.matrix.row(2) * points[i].homogeneous())(0) > 0 ? 1 : -1;
  if (side < 0) solution.matrix *= -1;
  const double least = std::sqrt(std::max(eigen.eigenvalues()[0], 0.0));
  const double next = std::sqrt(std::max(eigen.eigenvalues()[1], 0.0));
  solution.singular_ratio = next > 0 ? least / next : 1;
  return solution;
}

double squared_residual(const Matrix34& matrix, const Eigen::Vector3d& point, const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d h = matrix * point.homogeneous();
  return h.z() > 0 ? (h.hnormalized() - pixel).squaredNorm() : 1e30;
}

struct Score {
  double cost = 1e300;  // sum of squared residuals, each cut off at the threshold
  std::vector<int> inliers;
};

Score score(const Matrix34& matrix, const Points& points, const Pixels& pixels, double threshold_px) {
  Score result;
  result.cost = 0;
  const double cut = threshold_px * threshold_px;
  for (size_t i = 0; i < points.size(); ++i) {
    const double squared = squared_residual(matrix, points[i], pixels[i]);
    result.cost += std::min(squared, cut);
    if (squared < cut) result.inliers.push_back(static_cast<int>(i));
  }
  return result;
}

std::vector<int> draw_sample(int population, int size, std::mt19937& generator) {
  std::vector<int> sample;
  std::uniform_int_distribution<int> any(0, population - 1);
  while (static_cast<int>(sample.size()) < size) {
    const int candidate = any(generator);
    if (std::find(sample.begin(), sample.end(), candidate) == sample.end()) sample.push_back(candidate);
  }
  return sample;
}

}  // namespace

LinearProjection direct_linear_transform(const Points& points, const Pixels& pixels) {
  std::vector<int> all(points.size());
  std::iota(all.begin(), all.end(), 0);
  const Solution solution = solve(points, pixels, all);
  return {solution.matrix, solution.singular_ratio, std::vector<char>(points.size(), 1), 1.0};
}

LinearProjection ransac_projection(const Points& points, const Pixels& pixels, const RansacOptions& options) {
  const int count = static_cast<int>(points.size());
  const int sample_size = std::min(options.sample, count);
  std::mt19937 generator(options.seed);
  Solution best;
  Score best_score;
  double samples_needed = options.most_samples;
  for (int i = 0; i < options.most_samples && i < samples_needed; ++i) {
    Solution candidate = solve(points, pixels, draw_sample(count, sample_size, generator));
    Score candidate_score = score(candidate.matrix, points, pixels, options.threshold_px);
    // Local optimisation: refit to the inliers while that helps.
    while (candidate_score.cost < best_score.cost && static_cast<int>(candidate_score.inliers.size()) >= 6) {
      best = candidate;
      best_score = candidate_score;
      candidate = solve(points, pixels, best_score.inliers);
      candidate_score = score(candidate.matrix, points, pixels, options.threshold_px);
    }
    const double share = static_cast<double>(best_score.inliers.size()) / count;
    const double all_good = std::pow(share, sample_size);
    if (all_good >= 1) break;
    if (all_good > 0) samples_needed = std::log(1 - options.confidence) / std::log1p(-all_good);
  }
  LinearProjection result{best.matrix, best.singular_ratio, std::vector<char>(points.size(), 0), 0};
  for (const int i : best_score.inliers) result.inlier[i] = 1;
  result.inlier_share = static_cast<double>(best_score.inliers.size()) / count;
  return result;
}

}  // namespace selvedge::calib
