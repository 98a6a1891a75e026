#include "hardware_sim/world/operator_hand.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "hardware_sim/world/smooth_step.h"

namespace selvedge::hardware_sim {

void HandPath::carry(double start_s, const Eigen::Vector3d& place) {
  from_ = at(start_s);
  to_ = place;
  carry_start_s_ = start_s;
  wave_.reset();
}

void HandPath::wave(double start_s, const Eigen::Vector3d& pivot, double amplitude_m, double frequency_hz,
                    double duration_s) {
  from_ = to_ = at(start_s);
  carry_start_s_ = -1e9;
  wave_ = Wave{start_s, duration_s, amplitude_m, frequency_hz, pivot};
}

Eigen::Vector3d HandPath::at(double t) const {
  if (wave_) return waved(*wave_, t);
  return from_ + smooth_step((t - carry_start_s_) / options_.carry_s) * (to_ - from_);
}

Eigen::Vector3d HandPath::waved(const Wave& w, double t) const {
  const double since = t - w.start_s;
  if (since <= 0 || (w.duration_s > 0 && since >= w.duration_s)) return to_;
  const double ramp = 1 / w.frequency_hz;
  double share = smooth_step(since / ramp);
  if (w.duration_s > 0) share *= smooth_step((w.duration_s - since) / ramp);
  // φ is the integral of 2πf (1 + 0.03 sin 0.7 t).
  const double phase = 2 * M_PI * w.frequency_hz * (since + 0.03 / 0.7 * (1 - std::cos(0.7 * since)));
  const double swing = share * w.amplitude_m * (std::sin(phase) + 0.06 * (std::sin(2 * phase + 0.8) - std::sin(0.8)));
  const Eigen::Vector3d radius = to_ - w.pivot;
  const double length = std::hypot(radius.x(), radius.y());
  const Eigen::Vector2d along(radius.x() / length, radius.y() / length), across(-along.y(), along.x());
  const double forward = std::sqrt(std::max(0.0, length * length - swing * swing));
  Eigen::Vector3d place = w.pivot;
  place.head<2>() += forward * along + swing * across;
  place.z() = to_.z() + share * options_.sway_m * std::sin(0.5 * phase + 0.3);
  return place;
}

bool HandPath::still(double t) const {
  if (wave_) return t <= wave_->start_s || (wave_->duration_s > 0 && t >= wave_->start_s + wave_->duration_s);
  return t >= carry_start_s_ + options_.carry_s;
}

Eigen::Isometry3d board_pose(const BoardPoses& options, const Eigen::Vector3d& viewer, int index) {
  std::mt19937 random(options.seed * 7919u + unsigned(index) * 104729u + 1u);
  std::uniform_real_distribution<double> share(-1, 1);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (int a = 0; a < 3; ++a) pose.translation()[a] = options.centre_m[a] + share(random) * options.spread_m[a];
  // Grid axes when it faces the viewer: z towards the viewer, y up.
  const Eigen::Vector3d z = (viewer - options.centre_m).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d::UnitZ().cross(z).normalized();
  Eigen::Matrix3d facing;
  facing << x, z.cross(x), z;
  const double yaw = share(random) * options.yaw_rad, pitch = share(random) * options.pitch_rad,
               roll = share(random) * options.roll_rad;
  pose.linear() =
      facing * (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitX()) *
                Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()))
                   .toRotationMatrix();
  return pose;
}

}  // namespace selvedge::hardware_sim
