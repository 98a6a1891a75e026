#include "cloth/contact/law.h"

#include <algorithm>

namespace selvedge::cloth::contact {

namespace {

// normal_impulse along the normal and the friction that it allows.
Eigen::Vector3d with_friction(double friction, double normal_impulse, const Eigen::Vector3d& normal,
                              const Eigen::Vector3d& relative_velocity, double inverse_mass) {
  const Eigen::Vector3d sliding = relative_velocity - normal.dot(relative_velocity) * normal;
  const double speed = sliding.norm();
  Eigen::Vector3d impulse = normal_impulse * normal;
  if (speed > 0) impulse -= std::min(friction * normal_impulse, speed / inverse_mass) / speed * sliding;
  return impulse;
}

}  // namespace

double least_speed(const Law& law, double step_s, double gap_m) {
  return std::min(0.0, -(gap_m - 0.25 * law.thickness_m) / step_s);
}

Eigen::Vector3d impulse_of(const Law& law, double step_s, double gap_m, const Eigen::Vector3d& normal,
                           const Eigen::Vector3d& relative_velocity, double inverse_mass, double least) {
  const double rate = std::min(law.rate_1_s, 0.3 / step_s), approach = normal.dot(relative_velocity);
  // No deeper than the thickness: what lies within a body is let out, not shot out.
  const double overlap = law.thickness_m - std::max(gap_m, 0.0);
  double change = std::max(0.0, least - approach);
  if (overlap > 0)
    change = std::max(change, rate * rate * step_s * overlap - 2 * law.damping_ratio * rate * step_s * approach);
  return with_friction(law.friction, change / inverse_mass, normal, relative_velocity, inverse_mass);
}

Eigen::Vector3d stopping_impulse(double friction, const Eigen::Vector3d& normal,
                                 const Eigen::Vector3d& relative_velocity, double inverse_mass) {
  const double stop = std::max(0.0, -normal.dot(relative_velocity));
  return with_friction(friction, stop / inverse_mass, normal, relative_velocity, inverse_mass);
}

}  // namespace selvedge::cloth::contact
