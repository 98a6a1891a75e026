// Whether camera and tracker still agree: after each session (or on any campaign with images) the held corners
// that the frames show are compared with where the tracker says they are.
//
// A held corner in the image: the end of the fabric's side edge, a line fitted to sub-pixel outline points below
// it, followed up to where the silhouette ends. It is some tenths of a pixel off; a knocked camera moves it by
// many. Over the trials calib/drift.h says whether the camera has moved, by how much and since which trial; in each
// trial whose corners move fast enough calib/time_offset.h says how late its frames are. Frames are mapped with the
// calibration that the trial itself carries. px, s.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/drift.h"
#include "calib/time_offset.h"
#include "capture/trial/trial.h"
#include "report/progress.h"

namespace selvedge::station {

// A held corner as one frame shows it.
struct SeenCorner {
  double time_s = 0;
  int corner = 0;            // 0: left, 1: right
  Eigen::Vector2d pixel;
};

struct WatchedTrial {
  std::string name;
  size_t frames = 0;         // looked at
  std::vector<SeenCorner> corners;
  calib::TimeOffset delay;   // how late the frames are: offset_s < 0 where stamped too late
};

struct CalibrationWatch {
  calib::Drift camera;
  std::vector<WatchedTrial> trials;
};

struct WatchOptions {
  double frame_rate_hz = 10;       // frames looked at
  double reach_px = 60;            // a corner further from where it should be is not sought
  double pixel_noise_px = 1.0;     // of a corner found
};

// nullopt where the frame does not show that corner's side edge.
std::optional<Eigen::Vector2d> find_corner(const trial::GreyImage& image, const Eigen::Vector2d& expected, bool left, const WatchOptions& options = {});

// Campaigns without images have nothing to look at: no trial is judged, and the sentence says so.
CalibrationWatch watch_calibration(const trial::Campaign& campaign, const report::ProgressCallback& progress, const WatchOptions& options = {});

// FOLDER/calibration-watch.json.
void write_watch(const CalibrationWatch& watch, const std::filesystem::path& folder);

// The sentence on the camera, then a line a trial.
std::string to_text(const CalibrationWatch& watch);

}  // namespace selvedge::station
