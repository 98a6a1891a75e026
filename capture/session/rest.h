// Whether the fabric hangs still: neither its corners nor its picture move.
//
// Corners: means over the first and the last third of a window differ by less than still_m, each.
// Picture: of two frames quiet_frames_s apart, fewer than moving_share of the pixels differ by more than
// six standard deviations of the camera's noise, which the median difference of the same two frames gives.
// Both must hold for quiet_s without a break.
#pragma once

#include <deque>
#include <optional>

#include <Eigen/Core>

#include "capture/session/rig_client.h"

namespace selvedge::session {

struct RestOptions {
  double quiet_s = 1.0;
  double still_m = 0.0005;
  double quiet_frames_s = 0.3;
  double moving_share = 3e-4;
  double least_difference = 10;  // grey levels, however quiet the camera is
};

class RestDetector {
 public:
  explicit RestDetector(const RestOptions& options = {}) : options_(options) {}

  void add(const selvedge_rig::corner_sample_t& sample);
  void add(const Frame& frame);
  bool at_rest() const;
  // Of the newest pair of frames; none before.
  std::optional<double> moving_share() const { return moving_share_; }

 private:
  struct Corners {
    double time_s;
    Eigen::Vector3d left, right;
  };
  bool corners_still() const;

  RestOptions options_;
  std::deque<Corners> corners_;  // of the last quiet_s, both seen
  std::deque<Frame> frames_;
  std::optional<double> moving_share_;
  std::optional<double> quiet_since_s_;
  double newest_frame_s_ = 0;
};

}  // namespace selvedge::session
