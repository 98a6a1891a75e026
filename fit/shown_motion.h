// A trial as report::moving_sheets shows it: what was recorded at some of its times, the swatch then.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "model/simulation.h"
#include "report/moving_sheets.h"

namespace selvedge::fit {

// Places one after another, x, y, z of each column.
report::Points flat(const Eigen::Matrix3Xd& columns);

// A recorded trial at some of its times, evenly apart, the first and the last among them: name, times and what was seen
// then, without any model yet.
struct RecordedMotion {
  report::MovingSheet shown;
  std::vector<double> time_s;  // as exactly as they were recorded
  std::vector<size_t> place;   // among the times of the markers, or among the frames
};
RecordedMotion recorded_motion(const model::ObservedTrial& trial);

// Where a model that leaves off_mm (3 a marker and time) has the markers at these times; empty: none were tracked.
std::vector<report::Points> expected_markers(const model::ObservedTrial& trial, const RecordedMotion& recorded,
                                             const Eigen::VectorXd& off_mm);

// The swatch as `run` has it at the sample then or next after; NaN where it diverged.
class ShownSwatch {
 public:
  ShownSwatch(const model::Simulation& simulation, size_t trial);
  report::Points at(const cloth::Trajectory& run, double time_s) const;

 private:
  const std::vector<double>& sample_s_;
  std::vector<cloth::SurfacePoint> points_;
};

}  // namespace selvedge::fit
