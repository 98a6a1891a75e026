#include "capture/session/rest.h"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "geometry/order_statistics.h"

namespace selvedge::session {

namespace {

constexpr size_t kPixelStep = 3;  // every third pixel is enough to see motion

// Share of pixels whose difference is more than noise.
double share_that_moved(const Frame& before, const Frame& after, double least_difference) {
  std::array<size_t, 256> count{};
  size_t pixels = 0;
  for (size_t i = 0; i < before.pixels.size(); i += kPixelStep, ++pixels)
    ++count[static_cast<size_t>(std::abs(static_cast<int>(before.pixels[i]) - static_cast<int>(after.pixels[i])))];
  const int median = geometry::level_of_share(count, 0.5, static_cast<double>(pixels));
  // The median of |difference| is 0.95 σ for normal noise of σ in each frame; rounding hides half a level.
  const double threshold = std::max(least_difference, 6 * (median + 0.5) / 0.95 * 1.42);
  size_t moved = 0;
  for (auto level = static_cast<size_t>(threshold) + 1; level < 256; ++level) moved += count[level];
  return static_cast<double>(moved) / static_cast<double>(pixels);
}

}  // namespace

void RestDetector::add(const selvedge_rig::corner_sample_t& sample) {
  const auto left = marker(sample, "left"), right = marker(sample, "right");
  if (!left || !right) return;
  const double now_s = 1e-6 * static_cast<double>(sample.utime);
  corners_.push_back({now_s, *left, *right});
  while (corners_.front().time_s < now_s - options_.quiet_s) corners_.pop_front();
}

void RestDetector::add(const Frame& frame) {
  newest_frame_s_ = frame.mid_exposure_s;
  frames_.push_back(frame);
  while (frames_.size() > 2 && frames_[1].mid_exposure_s <= frame.mid_exposure_s - options_.quiet_frames_s)
    frames_.pop_front();
  if (frames_.front().mid_exposure_s > frame.mid_exposure_s - options_.quiet_frames_s) return;
  moving_share_ = share_that_moved(frames_.front(), frame, options_.least_difference);
  if (*moving_share_ > options_.moving_share) quiet_since_s_.reset();
  else if (!quiet_since_s_) quiet_since_s_ = frame.mid_exposure_s;
}

bool RestDetector::corners_still() const {
  const size_t third = corners_.size() / 3;
  if (third < 5 || corners_.back().time_s - corners_.front().time_s < 0.8 * options_.quiet_s) return false;
  Eigen::Matrix<double, 3, 2> first = Eigen::Matrix<double, 3, 2>::Zero(), last = first;
  for (size_t i = 0; i < third; ++i) {
    const Corners &a = corners_[i], &b = corners_[corners_.size() - 1 - i];
    first.col(0) += a.left, first.col(1) += a.right;
    last.col(0) += b.left, last.col(1) += b.right;
  }
  return ((last - first) / static_cast<double>(third)).colwise().norm().maxCoeff() < options_.still_m;
}

bool RestDetector::at_rest() const {
  return quiet_since_s_ && newest_frame_s_ - *quiet_since_s_ >= options_.quiet_s && corners_still();
}

}  // namespace selvedge::session
