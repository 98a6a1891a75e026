// The watch over the tracker by itself, on a clock of the test's own.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <selvedge_rig/arm_status_t.hpp>

#include "rig/arm/tracker_watch.h"

namespace selvedge {
namespace {

using selvedge_rig::corner_sample_t;

corner_sample_t sample_of(double taken_s, int64_t number, const Eigen::Vector3d& held_m) {
  corner_sample_t sample{};
  sample.utime = std::llround(1e6 * taken_s);
  sample.frame_number = number;
  sample.count = 2;
  sample.name = {"left", "right"};
  sample.x_m = {0, held_m.x()};
  sample.y_m = {0, held_m.y()};
  sample.z_m = {0, held_m.z()};
  sample.occluded = {0, 0};
  return sample;
}

// The tool swings 20 mm to and fro once a second, looked at each 8 ms; the tracker's places freeze at frozen_s though
// its times and numbers go on. When that is noticed.
double noticed_s(double frozen_s) {
  arm::TrackerWatch watch(arm::TrackerLimits{});
  const auto tool_m = [](double t) { return Eigen::Vector3d(0.3, 0.02 * std::sin(2 * std::numbers::pi * t), 0); };
  watch.begin(tool_m(0), 0);
  for (int64_t cycle = 0; cycle < 1000; ++cycle) {
    const double now_s = 0.008 * static_cast<double>(cycle);
    watch.see(sample_of(now_s, cycle + 1, tool_m(std::min(now_s, frozen_s))), now_s);
    if (const auto fault = watch.fault(tool_m(now_s), now_s)) {
      EXPECT_EQ(fault->first, selvedge_rig::arm_status_t::STOP_TRACKER);
      return now_s;
    }
  }
  return 1e9;
}

// Half a swing after it froze the tool is back where it was, whatever the phase that it froze in.
TEST(TrackerWatch, AFrozenCornerIsNoticedInTimeInEachPhaseOfASwing) {
  for (double frozen_s = 1; frozen_s < 2; frozen_s += 0.02) {
    EXPECT_GT(noticed_s(frozen_s), frozen_s + 0.49);
    EXPECT_LT(noticed_s(frozen_s), frozen_s + 0.5 + 2.5 * 0.008) << frozen_s;
  }
}

TEST(TrackerWatch, ACornerThatSwingsOrRestsWithItsToolIsNoFault) {
  EXPECT_EQ(noticed_s(1e9), 1e9);
  arm::TrackerWatch watch(arm::TrackerLimits{});
  const Eigen::Vector3d rest_m(0.3, 0, 0);
  watch.begin(rest_m, 0);
  for (int64_t cycle = 0; cycle < 1000; ++cycle) {
    const double now_s = 0.008 * static_cast<double>(cycle);
    watch.see(sample_of(now_s, cycle + 1, rest_m), now_s);
    EXPECT_FALSE(watch.fault(rest_m, now_s));
  }
}

}  // namespace
}  // namespace selvedge
