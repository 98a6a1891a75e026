// The held vertices of an experiment at any time, for integrators outside the lanes.
#pragma once

#include "cloth/simulate.h"

namespace selvedge::cloth {

kernel::Surroundings surroundings_of(const Experiment& experiment);

// Keeps a reference to the experiment.
class HeldMotion {
 public:
  HeldMotion(const Sheet& sheet, const Experiment& experiment);

  const std::vector<kernel::HeldVertex>& vertices() const { return vertices_; }

  // Of the 3N numbers of all positions, one where it is held.
  std::vector<char> is_held() const;

  // Set the held columns; all others stay. m, m/s.
  void place(double time_s, Eigen::Ref<Eigen::Matrix3Xd> position) const;
  void move(double time_s, Eigen::Ref<Eigen::Matrix3Xd> velocity) const;

 private:
  const HeldPath& path_;
  std::vector<kernel::HeldVertex> vertices_;
  int vertex_count_;
};

}  // namespace selvedge::cloth
