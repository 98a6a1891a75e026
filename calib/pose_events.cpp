#include "calib/pose_events.h"

#include <algorithm>
#include <map>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <ceres/ceres.h>

#include "calib/reprojection.h"

namespace selvedge::calib {

namespace {

constexpr double kGate = 20.25;  // rᵀΣ⁻¹r of a sighting that agrees: 4.5 standard deviations

using Shift6 = Eigen::Matrix<double, 6, 6>;

struct PoseInformation {
  Eigen::MatrixXd camera_shift;   // B
  Shift6 shift = Shift6::Zero();  // D
  PoseShift gradient = PoseShift::Zero();
};

double share_used(const RefineInput& input, int pose) {
  double used = 0, all = 0;
  for (size_t i = 0; i < input.sightings->size(); ++i)
    if ((*input.sightings)[i].pose == pose) {
      ++all;
      used += input.used[i];
    }
  return all > 0 ? used / all : 1;
}

// Share of a pose's sightings that agree with the fit under a shift.
double agreement(const RefineInput& input, const Refined& refined, int pose, const PoseShift& shift) {
  double agreeing = 0, all = 0;
  for (const Sighting& s : *input.sightings) {
    if (s.pose != pose) continue;
    const PixelDerivatives d = derivatives(refined.camera, s.point, &shift);
    const Eigen::Vector2d residual = d.pixel - s.pixel;
    const Eigen::Matrix2d covariance = sighting_covariance(d, refined.pixel_sd_px, input.tracker_noise_m);
    ++all;
    agreeing += residual.dot(covariance.inverse() * residual) < 4 * kGate;
  }
  return all > 0 ? agreeing / all : 0;
}

// Robust fit of the device's shift in some poses, everything else held; the scale comes down in steps so
// that shifts of a hundred pixels are found.
PoseShift fit_shift(const RefineInput& input, const Refined& refined, const std::vector<int>& poses) {
  PoseShift shift = PoseShift::Zero();
  CameraParameters camera = refined.camera;
  for (const double scale_px : {100.0, 20.0, 4.0, 1.0}) {
    const Eigen::Matrix2d whitening = Eigen::Matrix2d::Identity() / (scale_px * std::max(refined.pixel_sd_px, 0.2));
    ceres::Problem problem;
    problem.AddParameterBlock(camera.data(), kParameters);
    problem.SetParameterBlockConstant(camera.data());
    for (const Sighting& s : *input.sightings)
      if (std::find(poses.begin(), poses.end(), s.pose) != poses.end())
        problem.AddResidualBlock(new Reprojection(s.point, s.pixel, whitening, true), new ceres::CauchyLoss(1.0),
                                 camera.data(), shift.data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
  }
  return shift;
}

// Poses thrown out whole: a run of them at one end that share one shift is a knock, any other is one pose.
std::optional<PoseEvent> find_thrown_out(const RefineInput& input, const Refined& refined,
                                         const std::vector<int>& poses, const EventOptions& options) {
  std::vector<int> thrown_out;
  for (const int pose : poses)
    if (share_used(input, pose) < options.kept_share) thrown_out.push_back(pose);
  if (thrown_out.empty()) return std::nullopt;
  const size_t count = thrown_out.size();
  const auto all_agree = [&](const PoseShift& shift) {
    return std::all_of(thrown_out.begin(), thrown_out.end(),
                       [&](int pose) { return agreement(input, refined, pose, shift) > options.agreeing_share; });
  };
  const bool head = std::equal(thrown_out.begin(), thrown_out.end(), poses.begin());
  const bool tail = std::equal(thrown_out.begin(), thrown_out.end(), poses.end() - static_cast<std::ptrdiff_t>(count));
  if (count >= 2 && count < poses.size() && (head || tail)) {
    const PoseShift shift = fit_shift(input, refined, thrown_out);
    if (all_agree(shift)) return PoseEvent{true, head ? poses[count] : thrown_out.front(), 1e9, shift};
  }
  for (const int pose : thrown_out) {
    const PoseFit fit = fit_pose_shift(input, refined, pose);
    if (fit.agreeing_share > options.agreeing_share) return PoseEvent{false, pose, 1e9, fit.shift};
  }
  return std::nullopt;
}

}  // namespace

std::vector<int> poses_of(const std::vector<Sighting>& sightings) {
  std::vector<int> poses;
  for (const Sighting& s : sightings) poses.push_back(s.pose);
  std::sort(poses.begin(), poses.end());
  poses.erase(std::unique(poses.begin(), poses.end()), poses.end());
  return poses;
}

PoseFit fit_pose_shift(const RefineInput& input, const Refined& refined, int pose) {
  PoseFit fit;
  fit.shift = fit_shift(input, refined, {pose});
  fit.agreeing_share = agreement(input, refined, pose, fit.shift);
  return fit;
}

std::optional<PoseEvent> find_event(const RefineInput& input, const Refined& refined, const std::vector<int>& excluded,
                                    const EventOptions& options) {
  std::vector<int> poses = poses_of(*input.sightings);
  std::erase_if(poses, [&](int pose) { return std::find(excluded.begin(), excluded.end(), pose) != excluded.end(); });
  if (poses.size() < 3) return std::nullopt;
  if (auto event = find_thrown_out(input, refined, poses, options)) return event;

  const std::vector<int> places = free_parameters(input.order);
  const int size = static_cast<int>(places.size());
  Eigen::MatrixXd camera_information = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd camera_gradient = Eigen::VectorXd::Zero(size);
  std::map<int, PoseInformation> by_pose;
  for (size_t i = 0; i < input.used.size(); ++i) {
    if (!input.used[i]) continue;
    const Sighting& s = (*input.sightings)[i];
    const PixelDerivatives d = derivatives(refined.camera, s.point, shift_for(refined, input.stage_starts, s.pose));
    const Eigen::Matrix2d weight = sighting_covariance(d, refined.pixel_sd_px, input.tracker_noise_m).inverse();
    Eigen::MatrixXd jacobian(2, size);
    for (int j = 0; j < size; ++j) jacobian.col(j) = d.by_camera.col(places[j]);
    camera_information += jacobian.transpose() * weight * jacobian;
    camera_gradient += jacobian.transpose() * weight * (d.pixel - s.pixel);
    PoseInformation& pose = by_pose[s.pose];
    if (pose.camera_shift.size() == 0) pose.camera_shift = Eigen::MatrixXd::Zero(size, 6);
    pose.camera_shift += jacobian.transpose() * weight * d.by_shift;
    pose.shift += d.by_shift.transpose() * weight * d.by_shift;
    pose.gradient += d.by_shift.transpose() * weight * (d.pixel - s.pixel);
  }
  const Eigen::VectorXd scale = camera_information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> camera_solver(scale.asDiagonal() * camera_information * scale.asDiagonal());

  PoseEvent best;
  const auto consider = [&](bool knocked, int pose, const std::vector<int>& members) {
    PoseInformation sum;
    sum.camera_shift = Eigen::MatrixXd::Zero(size, 6);
    for (const int member : members) {
      const auto found = by_pose.find(member);
      if (found == by_pose.end()) continue;
      sum.camera_shift += found->second.camera_shift;
      sum.shift += found->second.shift;
      sum.gradient += found->second.gradient;
    }
    const Eigen::MatrixXd b = scale.asDiagonal() * sum.camera_shift;
    const Shift6 left = sum.shift - b.transpose() * camera_solver.solve(b);
    const PoseShift gradient =
        sum.gradient - b.transpose() * camera_solver.solve(Eigen::VectorXd(scale.asDiagonal() * camera_gradient));
    const PoseShift shift = -left.ldlt().solve(gradient);
    const double gain = -gradient.dot(shift);
    if (std::isfinite(gain) && gain > best.gain) best = {knocked, pose, gain, shift};
  };
  for (size_t k = 0; k < poses.size(); ++k) {
    consider(false, poses[k], {poses[k]});
    // A knock needs two poses on either side to be told from one bad pose.
    if (k >= 2 && k + 2 <= poses.size() &&
        stage_of(input.stage_starts, poses[k]) == stage_of(input.stage_starts, poses[k - 1]))
      consider(true, poses[k], std::vector<int>(poses.begin(), poses.begin() + static_cast<std::ptrdiff_t>(k)));
  }
  if (best.gain < options.least_gain) return std::nullopt;
  return best;
}

}  // namespace selvedge::calib
