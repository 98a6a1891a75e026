// The camera's picture of what the projector was told to show, on a running rig.
#pragma once

#include "calib/grey_image.h"
#include "calib/pattern_step.h"
#include "capture/session/rig_client.h"

namespace selvedge::station {

// The first image whose exposure began after the pattern showed. Throws DeviceFailed where none comes within 30 s.
calib::GreyImage image_under(session::RigClient& rig, const projector::Pattern& pattern);

projector::Pattern to_pattern(const calib::PatternStep& step);

}  // namespace selvedge::station
