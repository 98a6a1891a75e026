// Which spot of the fabric a pixel shows, as the base model has it there and then.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "diagnose/study.h"

namespace selvedge::diagnose {

class SpotsSeen {
 public:
  // How a trial moves; the simulation outlives this.
  SpotsSeen(const model::Simulation& simulation, size_t trial, cloth::Experiment experiment,
            cloth::Trajectory trajectory);

  bool finite() const { return trajectory_.finite; }
  void at_time(double t_s);
  // The vertex nearest to what was seen, by its place at rest, m.
  Eigen::Vector2d uv(const observe::DepthPoint& p) const;
  Eigen::Vector2d uv(const observe::OutlinePoint& p) const;

 private:
  Eigen::Vector2d nearest(const Eigen::RowVectorXd& squared) const;

  const model::Simulation* simulation_;
  size_t trial_;
  cloth::Experiment experiment_;
  cloth::Trajectory trajectory_;
  Eigen::Matrix3Xd position_;
};

// Of each trial; those without pictures are not simulated. Side by side in lanes.
std::vector<SpotsSeen> spots_seen(const Study& study);

}  // namespace selvedge::diagnose
