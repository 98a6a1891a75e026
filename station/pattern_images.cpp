#include "station/pattern_images.h"

namespace selvedge::station {

namespace {

constexpr double kFrame_s = 30;  // longest wait for one frame

}  // namespace

projector::Pattern to_pattern(const calib::PatternStep& step) {
  projector::Pattern pattern;
  pattern.level = step.level;
  pattern.inverted = step.inverted;
  pattern.orientation = step.horizontal ? projector::Orientation::horizontal : projector::Orientation::vertical;
  switch (step.kind) {
    case calib::PatternStep::Kind::off: pattern.kind = projector::PatternKind::off; break;
    case calib::PatternStep::Kind::solid: pattern.kind = projector::PatternKind::solid; break;
    case calib::PatternStep::Kind::gray_code:
      pattern.kind = projector::PatternKind::gray_code;
      pattern.bit = step.bit;
      break;
    case calib::PatternStep::Kind::phase_shift:
      pattern.kind = projector::PatternKind::phase_shift;
      pattern.period_px = step.period_px;
      pattern.first_bright_row_px = step.first_px;
      pattern.phase_rad = step.phase_rad;
      break;
  }
  return pattern;
}

calib::GreyImage image_under(session::RigClient& rig, const projector::Pattern& pattern) {
  const double shown_s = rig.show(pattern);
  const session::Frame frame = rig.first_frame_after(shown_s, kFrame_s);
  return Eigen::Map<const calib::GreyImage>(frame.pixels.data(), rig.height_px(), rig.width_px());
}

}  // namespace selvedge::station
