// Tracked dots on the fabric, thinned to the times that are compared.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "capture/trial/trial.h"
#include "observe/lost_frames.h"

namespace selvedge::observe {

// What becomes of the samples between those that are kept: nothing, or a parabola through all samples of a marker
// within half an interval gives the kept one, and its smaller noise.
enum class Thinning { dropped, averaged };

struct ObserveOptions {
  double rate_hz = 30;                    // observations are thinned to about this rate
  double from_s = 0, to_s = 1e9;          // of the trial's own time
  Thinning thinning = Thinning::dropped;  // of markers
};

// Position (marker, time) in column marker·times + time; NaN where the marker was not seen.
struct MarkerTrack {
  std::vector<double> time_s;
  std::vector<Eigen::Vector2d> uv;  // one a marker, m
  Eigen::Matrix3Xd position;        // m
  double noise_m = 3e-4;            // standard deviation of a position and axis
  std::vector<LostFrames> lost;     // of the whole recording: frames that are missing, though no stamp is
};

// Standard deviation of a tracked position and axis, m: as the trial states it, or what trackers usually have.
double stated_noise_m(const trial::Trial& trial);

// Of still fabric one time, the mean of all samples. Throws BadInput where no sample lies in the window.
MarkerTrack track_markers(const trial::Trial& trial, const ObserveOptions& options, bool still);

// What of it was seen between two times.
MarkerTrack piece_of(const MarkerTrack& track, double from_s, double to_s);

}  // namespace selvedge::observe
