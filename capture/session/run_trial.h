// Records one trial on a running, calibrated rig.
//
//   ask the operator → wait until the fabric hangs still → whatever the caller wants done at rest → (robot: arm, plan,
//   check the path) → record: a still lead-in, the motion, a tail → close the trial
//
// All times in a trial are host seconds since its origin, which lies just before the first frame: tracker samples
// as the tracker's daemon maps them, frames by their mid-exposure on the camera's clock mapped to the host's.
// While it records, SESSION_STATUS says ten times a second what is written and what is durable; its message names the
// attempt. An attempt that a device spoils stays as FOLDER/NAME-spoiled-K, a trial that is cut. trial.json's "clocks"
// says how the camera's and the tracker's clocks were mapped. A robot's path is planned and checked by the arm's daemon
// before recording starts; where a limit breaks, the trial is refused and nothing moves. Where somebody stops the arm,
// in whatever phase of whatever trial, the attempt is given up and the session waits for a person to reset the stop
// (operator_stop.h); that attempt does not count.
#pragma once

#include <filesystem>
#include <functional>

#include "capture/session/rig_client.h"
#include "capture/session/session_plan.h"
#include "geometry/projection.h"
#include "report/progress.h"

namespace selvedge::session {

struct TrialRecord {
  std::filesystem::path folder;
  size_t frames = 0, samples = 0;
  int64_t frames_lost = 0;
  double occluded_share = 0;  // of the samples, either corner
  double rest_s = 0;          // that the fabric took to come to rest
  bool started_at_rest = false;
  int attempts = 1;
};

struct RigOptics {
  geometry::Projection camera, projector;
};

// Renames FOLDER/NAME, where there is one, to FOLDER/NAME-spoiled-K with the first K from `attempt` on that is free.
void set_trial_aside(const std::filesystem::path& folder, const std::string& name, int attempt = 1);

// Writes FOLDER/NAME. at_rest: called in every attempt once the fabric hangs still; it may show other patterns.
// Throws DeviceFailed where the trial could not be recorded in plan.attempts attempts.
TrialRecord run_trial(RigClient& rig, const rig::Configuration& configuration, const SessionPlan& session,
                      const TrialPlan& plan, const RigOptics& optics, const std::filesystem::path& folder,
                      const report::ProgressCallback& progress, const std::function<void()>& at_rest = {});

}  // namespace selvedge::session
