// A surface that a depth camera, a scanner or a digital image correlation saw, made ready for fitting: clouds of points
// of which nobody knows which points of the fabric they are.
//
// A cloud is what a camera sees that knows depths: where its rays met the fabric. So it becomes a StripeTrack whose
// camera stands where the instrument stood, and all that is done with stripes is done with it. Where that place is not
// known the camera stands far off, straight before the fabric: a ray then says how far off the fabric lies across it.
// A square of a picture gives one depth, by a parabola through its points (least squares), and so the instrument's
// noise is averaged; what the parabola leaves is that noise. Squares whose points no parabola meets (an edge, a layer
// behind another, points that hang in the air beside it) are left out. The rim of what was seen gives outline points,
// known to a third of the distance between neighbouring points; of clouds too sparse for parabolas there are none, each
// square gives the point that is nearest to its middle.
#pragma once

#include <memory>

#include "capture/trial/trial.h"
#include "observe/marker_track.h"
#include "observe/stripe_residual.h"

namespace selvedge::observe {

// Reads the times in the window, thinned to options.rate_hz. The trial has a surface. Throws BadInput where no time in
// the window has points enough.
std::shared_ptr<const StripeTrack> track_cloud(const trial::Trial& trial, const ObserveOptions& options, bool still);

}  // namespace selvedge::observe
