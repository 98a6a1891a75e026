// Trials as an LCM event log: the messages that the rig's bus carried, on its channels, for lcm-logplayer and its like.
//
//   TRACKER_CORNERS    corner_sample_t     corners.csv: "left", "right"; markers.csv: marker 7 as "m7"
//   CAMERA_STAMP       frame_stamp_t       frames.csv (no pixels, as on the bus)
//   ARM_ARM            arm_status_t        robot.csv: tool point, measured and commanded, in the arm's base frame
//   PROJECTOR_PATTERN  projector_status_t  the stripes, at the start of each trial
//   SESSION_STATUS     session_status_t    "recording" at the start of each trial, "done" at its end
//
// An event's time is its message's utime: µs since the first trial's origin, since a trial does not keep the host's
// clock. Trials follow each other a second apart. What a trial does not keep is 0 or empty (device ticks, joints,
// arrival as utime); the arm's mode is MOVING while its commanded point moves, IDLE otherwise. sequence counts each
// channel from 1, over all trials. A trial whose own folder's parent holds the rig.toml of the rig has its arm's base
// from there; without it, the base frame is taken to be that of the motion capture.
#pragma once

#include <filesystem>

namespace selvedge::station {

struct LcmExported {
  int trials = 0;
  int64_t events = 0;
  double duration_s = 0;
};

// source: a trial, a campaign, or a run with campaigns in its folders (their order: by name). Whole file or nothing.
// Throws BadInput where the source is refused, std::runtime_error where the disk refuses.
LcmExported export_lcm(const std::filesystem::path& source, const std::filesystem::path& file);

}  // namespace selvedge::station
