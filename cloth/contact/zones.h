// The fail-safe: vertices whose impulses do not settle move on as one rigid body for a step.
//
// X. Provot, Collision and self-collision handling in cloth model dedicated to design garments, 1997; Bridson et
// al. 2002, section 7.3. A zone keeps its momentum and angular momentum,
//   v = v̄ + ω × (x − x̄),  ω = I⁻¹ L,
// and turns by the rotation of ω over the step, so that no two of its features meet. Where the rig holds some of
// a zone's vertices the zone goes along with them. Zones that touch join, until nothing is left to part.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "cloth/contact/pairs.h"

namespace selvedge::cloth::contact {

class Zones {
 public:
  explicit Zones(int vertex_count);

  // All vertices of a pair into one zone. False where they were already.
  bool join(const NearPair& pair);

  // Sets the velocities of all zones over the step from those given at the start of the fail-safe.
  void move_rigidly(double step_s, const double* inverse_mass, const Eigen::Matrix3Xd& position,
                    const Eigen::Matrix3Xd& given, Eigen::Matrix3Xd& velocity);

  void clear();

 private:
  int root(int vertex);
  void move_one(const std::vector<int>& zone, double step_s, const double* inverse_mass,
                const Eigen::Matrix3Xd& position, const Eigen::Matrix3Xd& given, Eigen::Matrix3Xd& velocity) const;

  std::vector<int> parent_;
  std::vector<int> touched_;
};

}  // namespace selvedge::cloth::contact
