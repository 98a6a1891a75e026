// A robot trial of a session on a simulated rig, stopped by an operator in one of its phases.
//
// The devices live in this process, so that joints and set-points are the controller's own; daemons are processes.
// After the stop the arm is watched for a while, then a person's word lifts it, and the trial must come to its end.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/progress.h"

namespace selvedge::cli {

struct StoppedTrial {
  std::string phase;
  double time_to_rest_s = 0;          // from the stop to the last motion of a joint
  int64_t set_points_after_rest = 0;  // that the controller was sent while the stop held
  double moved_rad = 0;               // largest change of a joint in that time
  bool asked = false;                 // the session asked for a person's word
  bool completed = false;             // and recorded the trial once it had it
};

// One for each phase: asked to hang the fabric, waiting for rest, armed, lead-in, moving, tail; or for the first of
// each `every`. watch_s: how long. Call before the process has threads. Throws std::runtime_error where the rig does
// not come up.
std::vector<StoppedTrial> stop_in_each_phase(double watch_s, size_t every, const report::ProgressCallback& progress);

}  // namespace selvedge::cli
