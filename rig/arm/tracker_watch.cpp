#include "rig/arm/tracker_watch.h"

#include <algorithm>

#include <fmt/format.h>
#include <selvedge_rig/arm_status_t.hpp>

namespace selvedge::arm {

using selvedge_rig::arm_status_t;
using selvedge_rig::corner_sample_t;

namespace {

constexpr double kFromTheFuture_s = 0.005;  // a sample from the future by more than this is not from our clock

std::optional<Eigen::Vector3d> marker_of(const corner_sample_t& sample, const std::string& name) {
  for (size_t i = 0; i < sample.name.size(); ++i) {
    if (sample.name[i] != name || sample.occluded[i]) continue;
    const Eigen::Vector3d position_m(sample.x_m[i], sample.y_m[i], sample.z_m[i]);
    if (position_m.allFinite()) return position_m;
  }
  return std::nullopt;
}

}  // namespace

void TrackerWatch::see(const corner_sample_t& sample, double now_s) {
  const double taken_s = 1e-6 * static_cast<double>(sample.utime);
  const bool anew = taken_s > sample_s_ && now_s - sample_s_ > limits_.timeout_s;
  const bool rises = taken_s > sample_s_ && sample.frame_number > number_;
  if (!(rises || anew) || taken_s > now_s + kFromTheFuture_s) {
    ++repeated_;
    return;
  }
  sample_s_ = taken_s;
  number_ = sample.frame_number;
  const auto held_m = marker_of(sample, limits_.held_corner), fixed_m = marker_of(sample, limits_.fixed_corner);
  if (!held_m || !fixed_m) return;
  changed_ = changed_ || !corners_ || corners_->held_m != *held_m;
  corners_ = Corners{*held_m, *fixed_m};
  seen_s_ = taken_s;
}

std::optional<TrackerWatch::Corners> TrackerWatch::corners(double now_s) const {
  return now_s - seen_s_ <= limits_.timeout_s ? corners_ : std::nullopt;
}

void TrackerWatch::begin(const Eigen::Vector3d& tool_m, double now_s) {
  changed_ = false;
  changed_tool_m_ = tool_m;
  changed_s_ = now_s;
  farthest_m_ = 0;
}

std::optional<std::pair<int8_t, std::string>> TrackerWatch::fault(const Eigen::Vector3d& tool_m, double now_s) {
  if (changed_) begin(tool_m, now_s);
  if (changed_tool_m_) farthest_m_ = std::max(farthest_m_, (tool_m - *changed_tool_m_).norm());
  const double old_s = now_s - seen_s_;
  if (!(old_s <= limits_.timeout_s))
    return {{arm_status_t::STOP_TRACKER,
             corners_ ? fmt::format("both corners not seen for {:.2f} s", old_s) : "both corners were never seen"}};
  if (now_s - changed_s_ > limits_.timeout_s && farthest_m_ > kMoved_m)
    return {
        {arm_status_t::STOP_TRACKER,
         fmt::format("the tracker shows the held corner at one place for {:.2f} s while the tool moved by {:.0f} mm",
                     now_s - changed_s_, 1e3 * farthest_m_)}};
  const double apart_m = (corners_->held_m - corners_->fixed_m).norm();
  if (limits_.corner_distance_m > 0 && !(apart_m <= limits_.corner_distance_m + kMarkerSlack_m))
    return {{arm_status_t::STOP_LIMIT,
             fmt::format("the corners are {:.4f} m apart, limit {:.4f} m", apart_m, limits_.corner_distance_m)}};
  return std::nullopt;
}

}  // namespace selvedge::arm
