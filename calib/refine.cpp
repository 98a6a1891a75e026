#include "calib/refine.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <ceres/ceres.h>

#include "calib/reprojection.h"
#include "geometry/order_statistics.h"

namespace selvedge::calib {

namespace {

constexpr double kLeastPixelSd = 0.02;  // px: no detector does better, and weights must stay finite
constexpr double kMostPixelSd = 1000;

// Residual and derivatives of every sighting at the estimate.
struct Linearised {
  std::vector<PixelDerivatives> derivatives;
  std::vector<Eigen::Vector2d> residual;
};

Linearised linearise(const RefineInput& input, const Refined& refined) {
  Linearised result;
  for (const Sighting& s : *input.sightings) {
    result.derivatives.push_back(derivatives(refined.camera, s.point, shift_for(refined, input.stage_starts, s.pose)));
    result.residual.push_back(result.derivatives.back().pixel - s.pixel);
  }
  return result;
}

double whitened_square(const Linearised& at, size_t i, double pixel_sd, double tracker_noise) {
  const Eigen::Matrix2d covariance = sighting_covariance(at.derivatives[i], pixel_sd, tracker_noise);
  return at.residual[i].dot(covariance.inverse() * at.residual[i]);
}

// The s at which `excess` (falling in s) passes zero, by bisection in log s.
double bisect_pixel_sd(const std::function<double(double)>& excess) {
  if (excess(kLeastPixelSd) <= 0) return kLeastPixelSd;
  double low = std::log(kLeastPixelSd), high = std::log(kMostPixelSd);
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2;
    (excess(std::exp(middle)) > 0 ? low : high) = middle;
  }
  return std::exp((low + high) / 2);
}

// Robust: the median of rᵀΣ⁻¹r is that of χ² with two degrees of freedom, 2 ln 2.
// Efficient: their sum is the number of residuals less that of the parameters.
double estimate_pixel_sd(const RefineInput& input, const Linearised& at, Loss loss, int parameters) {
  std::vector<size_t> used;
  for (size_t i = 0; i < input.used.size(); ++i)
    if (input.used[i]) used.push_back(i);
  return bisect_pixel_sd([&](double sd) {
    std::vector<double> squares;
    for (const size_t i : used) squares.push_back(whitened_square(at, i, sd, input.tracker_noise_m));
    if (loss == Loss::cauchy) return geometry::median(std::move(squares)) - 2 * std::log(2.0);
    double sum = 0;
    for (const double square : squares) sum += square;
    const double freedom = std::max(2.0 * static_cast<double>(used.size()) - parameters, 1.0);
    return sum - freedom;
  });
}

void solve_once(const RefineInput& input, const Linearised& at, Loss loss, Refined& refined) {
  ceres::Problem problem;
  problem.AddParameterBlock(refined.camera.data(), kParameters);
  std::vector<int> held;
  const std::vector<int> places = free_parameters(input.order);
  for (int i = 0; i < kParameters; ++i)
    if (std::find(places.begin(), places.end(), i) == places.end()) held.push_back(i);
  if (!held.empty()) problem.SetManifold(refined.camera.data(), new ceres::SubsetManifold(kParameters, held));
  for (size_t i = 0; i < input.used.size(); ++i) {
    if (!input.used[i]) continue;
    const Sighting& s = (*input.sightings)[i];
    const Eigen::Matrix2d covariance =
        sighting_covariance(at.derivatives[i], refined.pixel_sd_px, input.tracker_noise_m);
    // L⁻¹ of Σ = L Lᵀ.
    const Eigen::Matrix2d whitening =
        Eigen::LLT<Eigen::Matrix2d>(covariance).matrixL().solve(Eigen::Matrix2d::Identity().eval());
    auto* loss_function = loss == Loss::cauchy ? new ceres::CauchyLoss(2.0) : nullptr;
    const int stage = stage_of(input.stage_starts, s.pose);
    const bool shifted = stage < static_cast<int>(refined.earlier.size());
    std::vector<double*> blocks = {refined.camera.data()};
    if (shifted) blocks.push_back(refined.earlier[stage].data());
    problem.AddResidualBlock(new Reprojection(s.point, s.pixel, whitening, shifted), loss_function, blocks);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 60;
  options.function_tolerance = 1e-10;
  options.parameter_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
}

}  // namespace

int stage_of(const std::vector<int>& stage_starts, int pose) {
  return static_cast<int>(std::upper_bound(stage_starts.begin(), stage_starts.end(), pose) - stage_starts.begin());
}

const PoseShift* shift_for(const Refined& refined, const std::vector<int>& stage_starts, int pose) {
  const int stage = stage_of(stage_starts, pose);
  return stage < static_cast<int>(refined.earlier.size()) ? &refined.earlier[stage] : nullptr;
}

Eigen::Matrix2d sighting_covariance(const PixelDerivatives& d, double pixel_sd_px, double tracker_noise_m) {
  return pixel_sd_px * pixel_sd_px * Eigen::Matrix2d::Identity() +
         tracker_noise_m * tracker_noise_m * d.by_point * d.by_point.transpose();
}

std::vector<double> whitened_squares(const Refined& refined, const RefineInput& input) {
  const Linearised at = linearise(input, refined);
  std::vector<double> squares;
  for (size_t i = 0; i < at.residual.size(); ++i)
    squares.push_back(whitened_square(at, i, refined.pixel_sd_px, input.tracker_noise_m));
  return squares;
}

Refined refine(const RefineInput& input, const Refined& start, Loss loss) {
  const int parameters = static_cast<int>(free_parameters(input.order).size() + 6 * input.stage_starts.size());
  Refined refined = start;
  const int rounds = 4;
  for (int round = 0; round < rounds; ++round) {
    const double before = refined.pixel_sd_px;
    solve_once(input, linearise(input, refined), loss, refined);
    refined.pixel_sd_px = estimate_pixel_sd(input, linearise(input, refined), loss, parameters);
    if (std::abs(refined.pixel_sd_px - before) < 1e-3 * before) break;
  }
  return refined;
}

Uncertainty uncertainty(const RefineInput& input, const Refined& refined) {
  const std::vector<int> places = free_parameters(input.order);
  const int free_count = static_cast<int>(places.size());
  const int size = free_count + 6 * static_cast<int>(refined.earlier.size());
  const Linearised at = linearise(input, refined);

  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  std::vector<Eigen::MatrixXd> gain(at.residual.size());  // Jᵀ Σ⁻¹ G
  for (size_t i = 0; i < at.residual.size(); ++i) {
    if (!input.used[i]) continue;
    const PixelDerivatives& d = at.derivatives[i];
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(2, size);
    for (int j = 0; j < free_count; ++j) jacobian.col(j) = d.by_camera.col(places[j]);
    const int stage = stage_of(input.stage_starts, (*input.sightings)[i].pose);
    if (stage < static_cast<int>(refined.earlier.size())) jacobian.middleCols<6>(free_count + 6 * stage) = d.by_shift;
    const Eigen::Matrix2d weight = sighting_covariance(d, refined.pixel_sd_px, input.tracker_noise_m).inverse();
    information += jacobian.transpose() * weight * jacobian;
    gain[i] = jacobian.transpose() * weight * d.by_point;
  }

  // Inverted with unit diagonal: parameters differ by many orders of magnitude.
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * information * scale.asDiagonal());
  const double largest = eigen.eigenvalues().maxCoeff();
  const Eigen::VectorXd values = eigen.eigenvalues().cwiseMax(1e-15 * largest);
  const Eigen::MatrixXd covariance = scale.asDiagonal() * eigen.eigenvectors() * values.cwiseInverse().asDiagonal() *
                                     eigen.eigenvectors().transpose() * scale.asDiagonal();

  Uncertainty result;
  result.determined = eigen.eigenvalues().minCoeff() > 1e-13 * largest;
  result.covariance.setZero();
  for (int i = 0; i < free_count; ++i)
    for (int j = 0; j < free_count; ++j) result.covariance(places[i], places[j]) = covariance(i, j);
  result.by_point.assign(at.residual.size(), Eigen::Matrix<double, kParameters, 3>::Zero());
  for (size_t i = 0; i < at.residual.size(); ++i) {
    if (!input.used[i]) continue;
    const Eigen::MatrixXd moved = -covariance * gain[i];
    for (int j = 0; j < free_count; ++j) result.by_point[i].row(places[j]) = moved.row(j);
  }
  return result;
}

}  // namespace selvedge::calib
