#include "fit/trial_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "model/trial_error.h"

namespace selvedge::fit {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Root mean square of markers' speed error, mm/s: differences of position residuals over neighbouring times.
std::optional<double> velocity_error(const model::ObservedTrial& trial, const VectorXd& residual) {
  if (!trial.markers || trial.still || trial.markers->time_s.size() < 2 || residual.size() == 0) return std::nullopt;
  const observe::MarkerTrack& m = *trial.markers;
  double sum = 0;
  size_t count = 0;
  for (size_t k = 0; k < m.uv.size(); ++k)
    for (size_t j = 0; j + 1 < m.time_s.size(); ++j) {
      const auto at = static_cast<Index>(3 * (k * m.time_s.size() + j));
      const Eigen::Vector3d v =
          (residual.segment<3>(at + 3) - residual.segment<3>(at)) / (m.time_s[j + 1] - m.time_s[j]);
      if (!v.allFinite()) continue;
      sum += v.squaredNorm();
      ++count;
    }
  if (count == 0) return std::nullopt;
  return std::sqrt(sum / static_cast<double>(count));
}

// How the two held points lie: their middle, and axes of which one leads from the one to the other and one lies level.
Eigen::Isometry3d pose_of(const Eigen::Matrix<double, 3, 2>& held, const Eigen::Vector3d& down) {
  const Eigen::Vector3d across = (held.col(1) - held.col(0)).normalized();
  const Eigen::Vector3d level = down.cross(across).normalized();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << across, level, across.cross(level);
  pose.translation() = held.rowwise().mean();
  return pose;
}

// Root mean square distance, mm, of what was seen of a moving trial from what does not move in itself: held by an edge,
// a plate that hangs straight down from it; held by its corners, the fabric as it was first seen, carried along by
// them.
std::optional<double> plate_error(const model::ObservedTrial& trial) {
  const cloth::HeldPath& path = trial.experiment.path;
  const bool by_corners = path.hold == cloth::Hold::corners;
  if (!trial.markers || (by_corners && trial.still)) return std::nullopt;
  const observe::MarkerTrack& m = *trial.markers;
  const Eigen::Vector3d down = trial.experiment.gravity_m_s2.normalized();
  std::vector<std::optional<Eigen::Vector3d>> first(m.uv.size());  // seen, from the pose of the held points
  double sum = 0;
  size_t count = 0;
  for (size_t j = 0; j < m.time_s.size(); ++j) {
    const Eigen::Matrix<double, 3, 2> held = path.at(m.time_s[j]);
    const Eigen::Isometry3d pose = pose_of(held, down);
    for (size_t k = 0; k < m.uv.size(); ++k) {
      const Eigen::Vector3d seen = m.position.col(static_cast<Index>(k * m.time_s.size() + j));
      if (!seen.allFinite()) continue;
      if (by_corners && !first[k]) first[k] = pose.inverse() * seen;
      const Eigen::Vector3d plate =
          by_corners ? Eigen::Vector3d(pose * *first[k])
                     : held.col(0) + m.uv[k].x() / trial.width_m * (held.col(1) - held.col(0)) + m.uv[k].y() * down;
      sum += (seen - plate).squaredNorm();
      ++count;
    }
  }
  if (count == 0) return std::nullopt;
  return 1e3 * std::sqrt(sum / static_cast<double>(count));
}

template <class Get>
std::optional<double> pooled(const FitOutcome& outcome, const Get& get) {
  double sum = 0, count = 0;
  for (const TrialError& t : outcome.trials) {
    const std::optional<double> value = get(t);
    if (!value || !std::isfinite(*value)) continue;
    sum += *value * *value * static_cast<double>(t.frames);
    count += static_cast<double>(t.frames);
  }
  return count > 0 ? std::optional<double>(std::sqrt(sum / count)) : std::nullopt;
}

}  // namespace

void list_errors(FitOutcome& out) {
  for (size_t i = 0; i < out.simulation->trials().size(); ++i) {
    const model::ObservedTrial& t = out.simulation->trials()[i];
    const VectorXd time = out.simulation->time_s(i);
    TrialError e;
    e.name = t.name;
    const double until = t.still ? 1e300 : out.cut_s;
    e.start_mm = model::rms_mm(t, out.residuals_start.mm[i], time, -1e300, until);
    e.end_mm = model::rms_mm(t, out.residuals.mm[i], time, -1e300, until);
    e.moving_mm = t.still ? kNaN : model::rms_mm(t, out.residuals.mm[i], time, model::first_move_s(t), until);
    e.held_out_mm = until < 1e299 ? model::rms_mm(t, out.residuals.mm[i], time, until + 1e-9) : kNaN;
    if (until < 1e299) {
      e.held_out_interval_mm = model::rms_interval_mm(t, out.residuals.mm[i], time, until + 1e-9);
      e.held_out_in_noise = model::rms_in_noise(t, out.residuals.mm[i], time, until + 1e-9);
    }
    e.velocity_start_mm_s = velocity_error(t, out.residuals_start.mm[i]);
    e.velocity_end_mm_s = velocity_error(t, out.residuals.mm[i]);
    e.rigid_plate_mm = plate_error(t);
    e.frames = t.markers ? t.markers->time_s.size() : t.stripes->frames.size();
    out.trials.push_back(std::move(e));
  }
}

double held_out_mm(const FitOutcome& outcome) {
  return pooled(outcome, [](const TrialError& t) { return std::optional<double>(t.held_out_mm); }).value_or(kNaN);
}

double fitted_mm(const FitOutcome& outcome) {
  const auto fitted = [](const TrialError& t) {
    const double mm = std::isfinite(t.moving_mm) ? t.moving_mm : t.end_mm;
    return std::isfinite(t.held_out_mm) ? std::optional<double>(mm) : std::nullopt;
  };
  return pooled(outcome, fitted).value_or(kNaN);
}

std::optional<double> rigid_plate_mm(const FitOutcome& outcome) {
  return pooled(outcome, [](const TrialError& t) { return t.rigid_plate_mm; });
}

}  // namespace selvedge::fit
