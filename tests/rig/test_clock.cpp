#include "rig/clock.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace selvedge::rig {
namespace {

// A device whose clock is off by an offset and a drift, and whose samples arrive late at random.
struct Device {
  double ticks_per_s = 1e9;
  double offset_s = 5;    // host − device at host 0
  double drift_ppm = 50;  // host seconds per device second, minus one
  double minimum_delay_s = 0.003;
  double mean_delay_s = 0.001;
  double start_s = 1000;
  std::mt19937_64 random{1};

  int64_t ticks(double host_s) const {
    return std::llround((host_s - start_s) / (1 + drift_ppm * 1e-6) * ticks_per_s + (start_s - offset_s) * ticks_per_s);
  }
  double delay_s() {
    std::exponential_distribution<double> jitter(1 / mean_delay_s);
    std::uniform_real_distribution<double> chance(0, 1);
    return minimum_delay_s + jitter(random) + (chance(random) < 0.01 ? 0.05 : 0);  // now and then a stall
  }
  void feed(PassiveClock& clock, double from_s, double to_s, double rate_hz) {
    for (double t = from_s; t < to_s; t += 1 / rate_hz) clock.add(ticks(t), std::llround((t + delay_s()) * 1e6));
  }
  double error_s(const PassiveClock& clock, double host_s) const { return clock.map()->host_s(ticks(host_s)) - host_s; }
};

ClockOptions known_delay() {
  ClockOptions options;
  options.minimum_delay_s = 0.003;
  return options;
}

TEST(PassiveClock, FindsOffsetAndDriftBelowTheJitter) {
  Device device;
  PassiveClock clock(known_delay());
  device.feed(clock, 1000, 1060, 60);
  ASSERT_TRUE(clock.map());
  EXPECT_NEAR(device.error_s(clock, 1059), 0, 1e-4);
  EXPECT_NEAR(clock.map()->drift_ppm, 50, 5);
}

TEST(PassiveClock, StatesAnUncertaintyThatCoversTheError) {
  for (const double mean_delay_s : {0.0002, 0.002}) {
    for (const double seconds : {5.0, 60.0}) {
      int covered = 0;
      const int runs = 200;
      double squares = 0, stated = 0;
      for (int run = 0; run < runs; ++run) {
        Device device;
        device.mean_delay_s = mean_delay_s;
        device.random.seed(static_cast<unsigned>(run));
        PassiveClock clock(known_delay());
        device.feed(clock, 1000, 1000 + seconds, 60);
        const double error_s = device.error_s(clock, 1000 + seconds);
        covered += std::abs(error_s) <= 2 * clock.map()->uncertainty_s;
        squares += error_s * error_s;
        stated += clock.map()->uncertainty_s / runs;
      }
      EXPECT_GE(covered, runs * 19 / 20) << "mean delay " << mean_delay_s << " s, " << seconds << " s of samples";
      // Honest, not merely large.
      EXPECT_LE(stated, 6 * std::sqrt(squares / runs));
    }
  }
}

TEST(PassiveClock, BracketsAreUsedWhereTheyAreTighter) {
  Device device;
  ClockOptions options;
  options.minimum_delay_sd_s = 0.002;  // the transfer time is not known
  PassiveClock clock(options);
  std::uniform_real_distribution<double> half(2e-5, 3e-4);
  for (double t = 1000; t < 1030; t += 0.5) {
    device.feed(clock, t, t + 0.5, 60);
    const double way_s = half(device.random), back_s = half(device.random);
    clock.add_bracket(device.ticks(t), std::llround((t - way_s) * 1e6), std::llround((t + back_s) * 1e6));
  }
  EXPECT_LE(std::abs(device.error_s(clock, 1030)), 1e-4);
  EXPECT_LE(clock.map()->uncertainty_s, 1e-4);
}

// On a busy machine few readings are quick, and the newest sample may lie far from them.
TEST(PassiveClock, CoversTheErrorWhereFewReadingsAreQuick) {
  for (const double wait_s : {1e-5, 1e-4, 1e-3}) {
    for (const double seconds : {2.0, 10.0}) {
      int covered = 0;
      const int runs = 200;
      double squares = 0, stated = 0;
      for (int run = 0; run < runs; ++run) {
        Device device;
        device.random.seed(static_cast<unsigned>(run));
        std::exponential_distribution<double> waits(1 / wait_s);
        PassiveClock clock;
        for (double t = 1000; t < 1000 + seconds; t += 0.5) {
          const double way_s = 2e-5 + waits(device.random), back_s = 2e-5 + waits(device.random);
          clock.add_bracket(device.ticks(t), std::llround((t - way_s) * 1e6), std::llround((t + back_s) * 1e6));
        }
        const double error_s = device.error_s(clock, 1000 + seconds - 0.5);
        covered += std::abs(error_s) <= 2 * clock.map()->uncertainty_s;
        squares += error_s * error_s;
        stated += clock.map()->uncertainty_s / runs;
      }
      EXPECT_GE(covered, runs * 19 / 20) << wait_s << " s of waiting, " << seconds << " s of readings";
      if (wait_s >= 1e-4) { EXPECT_LE(stated, 3 * std::sqrt(squares / runs)); }
    }
  }
}

TEST(PassiveClock, StartsAnewAfterAJumpEitherWay) {
  for (const double step_s : {-0.5, 0.5}) {
    Device device;
    PassiveClock clock(known_delay());
    device.feed(clock, 1000, 1020, 60);
    device.offset_s += step_s;
    device.feed(clock, 1020, 1050, 60);
    ASSERT_TRUE(clock.map());
    EXPECT_EQ(clock.map()->jumps, 1) << step_s;
    EXPECT_NEAR(device.error_s(clock, 1050), 0, 2e-4) << step_s;
  }
}

TEST(PassiveClock, RidesOutAStallOfASecond) {
  Device device;
  PassiveClock clock(known_delay());
  device.feed(clock, 1000, 1020, 60);
  for (int i = 0; i < 60; ++i) clock.add(device.ticks(1020 + i / 60.0), std::llround(1021.2 * 1e6));
  device.feed(clock, 1021, 1040, 60);
  EXPECT_EQ(clock.map()->jumps, 0);
  EXPECT_NEAR(device.error_s(clock, 1040), 0, 1e-4);
}

TEST(PassiveClock, LatenessIsNoJumpWhereTheClockIsRead) {
  Device device;
  PassiveClock clock(known_delay());
  for (double t = 1000; t < 1040; t += 1) {
    clock.add_bracket(device.ticks(t), std::llround((t - 1e-4) * 1e6), std::llround((t + 1e-4) * 1e6));
    device.minimum_delay_s = t < 1010 ? 0.003 : 0.2;  // the machine is overloaded from here on
    device.feed(clock, t, t + 1, 60);
  }
  EXPECT_EQ(clock.map()->jumps, 0);
  EXPECT_NEAR(device.error_s(clock, 1040), 0, 1e-4);
  device.offset_s += 0.5;
  for (double t = 1040; t < 1050; t += 1)
    clock.add_bracket(device.ticks(t), std::llround((t - 1e-4) * 1e6), std::llround((t + 1e-4) * 1e6));
  EXPECT_EQ(clock.map()->jumps, 1);
  EXPECT_NEAR(device.error_s(clock, 1050), 0, 1e-4);
}

TEST(PassiveClock, SaysNothingBeforeItKnows) {
  PassiveClock clock;
  EXPECT_FALSE(clock.map());
  clock.add(0, 0);
  EXPECT_FALSE(clock.map());
}

}  // namespace
}  // namespace selvedge::rig
