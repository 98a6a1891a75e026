// Keeping a simulated sheet near where the real one was seen while its parameters are still wrong.
//
// A motion that runs free leaves the recorded one for good where a fold snaps another way, and what it does after that
// tells nothing of the parameters. Nudged a little towards what was seen ("nudging": Hoke & Anthes 1976; for estimating
// parameters: Parlitz 1996) it stays in the same folds, and what is left of the error is what the model's forces lack,
// over the square of the gain. Nudging is no force of the model: it serves to find parameters, and predictions that
// are compared with other models' run free.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "cloth/kernel/step_filter.h"
#include "cloth/surface_point.h"

namespace selvedge::cloth {

// Where points of the fabric were seen. Shared by all runs of a trial.
struct GuideTrack {
  std::vector<SurfacePoint> points;
  std::vector<double> time_s;  // ascending
  Eigen::Matrix3Xd position;   // m; (point, time) in column point · times + time, NaN where it was not seen
  // Of length 1, columns as position: only what lies along it pulls, for a point whose place along the surface is not
  // known. No columns: everything pulls.
  Eigen::Matrix3Xd normal = {};

  struct Seen {
    Eigen::Matrix3Xd position, velocity;  // one a point, NaN where it was not seen
    Eigen::Matrix3Xd normal = {};         // of the nearer time
  };
  // Cubic between the times; at rest before the first and after the last.
  Seen at(double t_s) const;
};

// The hold may let go now and then, so that what a model predicts for a short time ahead is seen.
struct LetGo {
  double free_s = 0;   // so long at a time, and held for as long in between; 0: never
  double first_s = 0;  // the first time, after held_s
  double held_s = 0;   // held for so long at first, from Guide::start_s

  bool is_free(double since_start_s) const;
};

struct Guide {
  std::shared_ptr<const GuideTrack> track;
  double nudging_per_s = 10;  // ω: a point that is Δ from where it was seen is accelerated by ω² Δ
  double start_s = 0;         // of the run
  LetGo let_go = {};          // of motions; equilibria are nudged all the same
  // The time on the track at which the fabric is seen as it is at t; none: t.
  std::function<double(double)> stamp_of = {};
};

// Forces on all vertices, N, added to 3N numbers: each point carries an equal part of mass_kg. velocity: null at rest.
void add_nudging(const Guide& guide, double mass_kg, double t_s, const double* position, const double* velocity,
                 double* force);

// Nudging of ω = 10/s need not act at each step; a run may give it so seldom, s.
inline constexpr double kNudgeEvery_s = 2e-3;

// Pulls over each step that it is given of a run, with `after` run behind it where there is one.
kernel::StepFilter guided(std::shared_ptr<const Guide> guide, kernel::StepFilter after);

}  // namespace selvedge::cloth
