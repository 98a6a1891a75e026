#include "cloth/held_motion.h"

namespace selvedge::cloth {

kernel::Surroundings surroundings_of(const Experiment& e) {
  kernel::Surroundings s;
  for (int a = 0; a < 3; ++a) {
    s.gravity[a] = e.gravity_m_s2(a);
    s.air_velocity[a] = e.air_velocity_m_s(a);
  }
  return s;
}

HeldMotion::HeldMotion(const Sheet& sheet, const Experiment& experiment)
    : path_(experiment.path), vertices_(held_vertices(sheet, experiment.path.hold)),
      vertex_count_(sheet.data.vertex_count) {}

std::vector<char> HeldMotion::is_held() const {
  std::vector<char> held(3 * static_cast<size_t>(vertex_count_), 0);
  for (const kernel::HeldVertex& h : vertices_)
    for (int a = 0; a < 3; ++a) held[static_cast<size_t>(3 * h.vertex + a)] = 1;
  return held;
}

void HeldMotion::place(double time_s, Eigen::Ref<Eigen::Matrix3Xd> position) const {
  const Eigen::Matrix<double, 3, 2> at = path_.at(time_s);
  for (const kernel::HeldVertex& h : vertices_)
    position.col(h.vertex) = at.col(0) + h.along * (at.col(1) - at.col(0)) + h.below_m * path_.clamp_direction;
}

void HeldMotion::move(double time_s, Eigen::Ref<Eigen::Matrix3Xd> velocity) const {
  const Eigen::Matrix<double, 3, 2> rate = path_.velocity_at(time_s);
  for (const kernel::HeldVertex& h : vertices_)
    velocity.col(h.vertex) = rate.col(0) + h.along * (rate.col(1) - rate.col(0));
}

}  // namespace selvedge::cloth
