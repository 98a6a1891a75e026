// What a fabric meets that it does not move: capsules that go along given paths, and fixed half-spaces.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "cloth/contact/hierarchy.h"
#include "cloth/contact/law.h"

namespace selvedge::cloth::contact {

// All points within radius_m of the segment.
struct Capsule {
  Eigen::Vector3d from, to;  // m
  double radius_m = 0;
};

// Solid where normal·x < offset_m; normal of unit length, pointing out.
struct HalfSpace {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset_m = 0;
};

struct Body {
  std::function<std::vector<Capsule>(double time_s)> capsules_at;  // as many at every time; may be empty
  std::vector<HalfSpace> half_spaces;
};

// A body at the two ends of a step.
struct BodyStep {
  std::vector<Capsule> start, end;
};

// Vertices near a body and, where the mesh is coarse beside a capsule's curvature, edges: kept over many steps
// like PairList, with the capsules' own displacement counted into the travel.
class BodyContacts {
 public:
  BodyContacts(const Surface& surface, const Body& body);

  BodyStep step(double start_s, double step_s) const;

  // How far the body's surface gets in a step beside a frame that moves with `drift`, m.
  static double displacement(const BodyStep& body, const Eigen::Vector3d& drift_m);

  // tree: updated to these positions.
  void rebuild(Hierarchy& tree, const Eigen::Matrix3Xd& position, const BodyStep& body, double thickness_m,
               double reach_m);

  // Changes the velocities of what comes within the thickness before travel reaches travel_end_m.
  void collide(const Law& law, const BodyStep& body, double step_s, const double* inverse_mass,
               const Eigen::Matrix3Xd& position, double travel_m, double travel_end_m, Eigen::Matrix3Xd& velocity);

  bool is_there() const { return body_.capsules_at || !body_.half_spaces.empty(); }

 private:
  struct Item {
    double wake_m;
    int capsule;   // or half-space, behind the capsules
    int one, two;  // vertices; two is −1 for a vertex alone
  };
  struct Touch {
    Eigen::Vector3d normal, body_velocity;
    double gap_m, share;  // share: along the edge
  };
  Touch touch(const Item& item, const BodyStep& body, double step_s, const Eigen::Matrix3Xd& position) const;

  const Surface& surface_;
  const Body& body_;
  double edge_m_ = 0;  // longest flat edge
  std::vector<Item> items_;
};

}  // namespace selvedge::cloth::contact
