// A trial as report::moving_sheets shows it: which times, the swatch at each, what was recorded then.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "model/simulation.h"
#include "report/moving_sheets.h"

namespace selvedge::fit {

inline constexpr int kSheetAcross = 10;  // points of a sheet that is shown, each way

// Some of so many times, evenly apart, the first and the last among them.
std::vector<size_t> shown_times(size_t count);

// Places one after another, x, y, z of each column.
report::Points flat(const Eigen::Matrix3Xd& columns);

// The markers at one time: where they were seen, off by `off_mm` (3 a marker and time; empty: not at all).
report::Points markers_at(const observe::MarkerTrack& track, size_t time, const Eigen::VectorXd& off_mm);

// Points of the surface that one frame or cloud showed, some hundreds at most.
report::Points surface_at(const observe::StripeTrack& track, const observe::StripeFrame& frame);

// The swatch at each of these times, as `run` has it at the sample then or next after; NaN where it diverged.
class ShownSwatch {
 public:
  ShownSwatch(const model::Simulation& simulation, size_t trial);
  report::Points at(const cloth::Trajectory& run, double time_s) const;

 private:
  const std::vector<double>& sample_s_;
  std::vector<cloth::SurfacePoint> points_;
};

}  // namespace selvedge::fit
