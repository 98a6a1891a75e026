// Frames that a tracker lost without a gap in its stamps.
//
// Over a few frames markers follow a curve in time, and follow it better if a frame is taken to be missing where one
// is. That is seen in the recording alone, wherever the fabric moves by more than the noise from frame to frame.
#pragma once

#include <vector>

#include "capture/trial/trial.h"

namespace selvedge::observe {

struct LostFrames {
  double from_s = 0, to_s = 0;  // stamps of the frames before and after
  double count = 1;             // that are missing between them
};

// Ascending. noise_m: standard deviation of a position and axis.
std::vector<LostFrames> lost_frames(const trial::Markers& markers, double noise_m);

// Stamps that fall behind: what is stamped t shows the fabric as it was at shown_at(t).
struct StampDrift {
  double per_s = 0;              // s/s: a delay grows by so much a second
  double from_s = 0;             // stamp at which it is nothing
  std::vector<LostFrames> lost;  // ascending
  double each_s = 0;             // if any: it grows at lost frames alone, at one by as much as else in so long a time

  double shown_at(double stamp_s) const;
  double stamp_of(double shown_s) const;  // its inverse
};

}  // namespace selvedge::observe
