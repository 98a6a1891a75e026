// Whether the tracker still sees the two corners, for a moving arm.
//
// What counts is when a sample was taken (its own utime) and that its number and its time rise, not that something
// arrived: a tracker that repeats itself, or whose samples come late, is a tracker that is lost. So is one that shows
// the held corner at the very same place, to the last bit, for that long, though the tool was kMoved_m away meanwhile
// (a tool that swings may be back). Numbers may begin anew only after a silence longer than the time-out, by which a
// moving arm has been stopped.
// Positions in the motion-capture frame, m; times on the host's clock, s.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include <Eigen/Core>
#include <selvedge_rig/corner_sample_t.hpp>

namespace selvedge::arm {

struct TrackerLimits {
  double timeout_s = 0.5;
  double corner_distance_m = 0;  // 0: nobody checks
  std::string held_corner = "right", fixed_corner = "left";
};

class TrackerWatch {
 public:
  static constexpr double kMarkerSlack_m = 0.003;  // marker noise must not stop what the plan allows
  static constexpr double kMoved_m = 0.005;

  explicit TrackerWatch(TrackerLimits limits) : limits_(std::move(limits)) {}

  void see(const selvedge_rig::corner_sample_t& sample, double now_s);

  struct Corners {
    Eigen::Vector3d held_m, fixed_m;
  };
  // Both, where they were seen within the time-out.
  std::optional<Corners> corners(double now_s) const;

  // A path begins with the tool at tool_m (any frame).
  void begin(const Eigen::Vector3d& tool_m, double now_s);
  // A STOP_ constant of arm_status_t and why; none where all is well.
  std::optional<std::pair<int8_t, std::string>> fault(const Eigen::Vector3d& tool_m, double now_s);
  int64_t repeated() const { return repeated_; }  // samples whose number or time did not rise, or from the future

 private:
  const TrackerLimits limits_;
  std::optional<Corners> corners_;
  double seen_s_ = -1e9;    // when the newest sample with both was taken
  double sample_s_ = -1e9;  // when the newest sample was taken
  int64_t number_ = 0;
  bool changed_ = false;                           // the held corner, since changed_tool_m_ was noted
  std::optional<Eigen::Vector3d> changed_tool_m_;  // where the tool was when the corner last moved
  double changed_s_ = 0, farthest_m_ = 0;          // when, and how far from there the tool has been since
  int64_t repeated_ = 0;
};

}  // namespace selvedge::arm
