// Whether camera, projector and tracker still agree: after each session (or on any campaign with images) the held
// corners that the frames show are compared with where the tracker says they are.
//
// Camera: a held corner's pixel (station/held_corners.h) against the tracked corner. It is some tenths of a pixel off;
// a knocked camera moves it by many. Projector: the line that the stripes about a held corner say lights it, against
// the line that the projector's matrix gives the tracked corner. Taken where the camera sees the tracked corner, with
// the camera as it stands in that trial. Stripes repeat: a projector that turned by whole periods looks as if it stood;
// and stripes that run along the rows show no shift along them. Sessions therefore also record projector-check.csv
// (station/projector_check.h), which tells both coordinates outright; where a trial has it, it is taken instead. Over
// the trials calib/drift.h says whether a device has moved, by how much and since which trial; in each trial whose
// corners move calib/time_offset.h says how late its frames are. Every trial is judged by the calibration that it
// carries itself. px, s.
#pragma once

#include <string>
#include <vector>

#include "calib/drift.h"
#include "calib/time_offset.h"
#include "capture/trial/trial.h"
#include "report/progress.h"
#include "station/held_corners.h"

namespace selvedge::station {

// A held corner in one frame.
struct SeenCorner {
  double time_s = 0;
  int corner = 0;           // 0: left, 1: right
  Eigen::Vector3d tracked;  // m
  HeldCorner seen;
};

struct WatchedTrial {
  std::string name;
  size_t frames = 0;  // looked at
  std::vector<SeenCorner> corners;
  calib::TimeOffset delay;  // how late the frames are: offset_s < 0 where stamped too late
};

struct CalibrationWatch {
  calib::Drift camera, projector;
  std::vector<WatchedTrial> trials;

  bool moved() const { return camera.since || projector.since; }
};

struct WatchOptions {
  double frame_rate_hz = 10;  // frames looked at for drift; those of a trial that moves are all looked at for its delay
  size_t least_sightings = 8;     // of a trial, for its drift to be judged
  double least_travel_m = 0.002;  // of a corner, for a delay to be sought
  double pixel_noise_px = 1.0;    // of a corner found
  double line_noise_px = 0.5;     // of the camera's, along the stripes' normal
  double code_noise_px = 0.6;     // of the projector pixel read from the grey code at a corner
  double pixel_common_px = 0.5;   // of either that may go with the motion, since the fabric lags behind its corner
  double line_common_px = 0.1;
  CornerOptions corner;
};

// Campaigns without images have nothing to look at: no trial is judged, and the sentences say so.
CalibrationWatch watch_calibration(const trial::Campaign& campaign, const report::ProgressCallback& progress,
                                   const WatchOptions& options = {});

// FOLDER/calibration-watch.json.
void write_watch(const CalibrationWatch& watch, const std::filesystem::path& folder);

// A sentence on each device, then a line a trial.
std::string to_text(const CalibrationWatch& watch);

}  // namespace selvedge::station
