// How the two sides of a pair move against each other, and an impulse between them.
#pragma once

#include "cloth/contact/closest.h"

namespace selvedge::cloth::contact {

struct PairMotion {
  Eigen::Vector3d relative = Eigen::Vector3d::Zero();  // m/s, of the first side to the second
  double inverse_mass = 0;                             // 1/kg, of the pair; 0 where all of it is held
};

inline PairMotion motion_of(const std::array<int, 4>& vertex, const std::array<double, 4>& weight,
                            const double* inverse_mass, const Eigen::Matrix3Xd& velocity) {
  PairMotion m;
  for (size_t i = 0; i < 4; ++i) {
    m.relative += weight[i] * velocity.col(vertex[i]);
    m.inverse_mass += weight[i] * weight[i] * inverse_mass[vertex[i]];
  }
  return m;
}

// impulse: on the first side, N·s.
inline void apply(const Eigen::Vector3d& impulse, const std::array<int, 4>& vertex, const std::array<double, 4>& weight,
                  const double* inverse_mass, Eigen::Matrix3Xd& velocity) {
  for (size_t i = 0; i < 4; ++i) velocity.col(vertex[i]) += weight[i] * inverse_mass[vertex[i]] * impulse;
}

}  // namespace selvedge::cloth::contact
