// Maps a device's clock to the host clock from what arrives, without asking the device to do anything.
//
// A sample taken at device time d arrives at host time h = a + b·d + delay with delay ≥ minimum_delay_s, so
// all samples lie above the line a + b·d + minimum_delay_s. The estimate is the line below all samples of a
// sliding window that is closest to them on average: the edge of their lower convex hull that spans the mean
// device time. Where the device's clock can be read on request (GigE Vision's timestamp latch), the host times
// before and after the request bracket the reading, and the line must pass between them.
//
// Source: E. Olson, A passive solution to the sensor synchronization problem, IROS 2010 (there with an assumed
// bound on drift; here drift is estimated).
//
// Host clock: CLOCK_MONOTONIC in microseconds, one for all processes of a host.
#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <vector>

namespace selvedge::rig {

int64_t host_now_us();
double host_now_s();  // the same in seconds

// host_s(ticks) = reference_host_s + (ticks − reference_ticks) / ticks_per_s · (1 + drift_ppm·1e-6)
struct ClockMap {
  double ticks_per_s = 1e9;
  int64_t reference_ticks = 0;
  double reference_host_s = 0;
  double drift_ppm = 0;                                            // positive: the device clock is slow
  double uncertainty_s = std::numeric_limits<double>::infinity();  // one sd at the newest sample
  int64_t samples = 0;
  int jumps = 0;  // of the device clock, noticed so far

  double host_s(int64_t ticks) const;
  int64_t host_us(int64_t ticks) const;
};

struct ClockOptions {
  double ticks_per_s = 1e9;        // nominal
  double window_s = 60;            // samples older than this are forgotten
  double bin_s = 0.25;             // only the sample with the smallest delay in each bin is kept
  double minimum_delay_s = 0;      // known part of the delay: exposure, read-out, transfer
  double minimum_delay_sd_s = 0;   // how well that is known
  double jump_s = 0.02;            // a step beyond this is a jump of the device clock: start anew
  double largest_drift_ppm = 500;  // beyond what any quartz does
};

class PassiveClock {
 public:
  explicit PassiveClock(const ClockOptions& options = {});

  // A sample taken at device_ticks arrived at arrival_us.
  void add(int64_t device_ticks, int64_t arrival_us);
  // The device's clock read device_ticks at some moment between before_us and after_us.
  void add_bracket(int64_t device_ticks, int64_t before_us, int64_t after_us);

  // Empty before the second bin.
  const std::optional<ClockMap>& map() const { return map_; }

 private:
  struct Point {
    double device_s;  // since origin_ticks_
    double host_s;    // since origin_us_, minimum delay taken off
  };
  struct Bracket {
    double device_s, before_s, after_s;
  };
  void restart();
  Point relative(int64_t device_ticks, int64_t host_us);
  int64_t bin(double device_s) const;
  void estimate();
  std::optional<ClockMap> from_arrivals() const;
  std::optional<ClockMap> from_brackets() const;
  ClockMap to_map(double intercept_s, double drift, double uncertainty_s) const;

  ClockOptions options_;
  bool has_origin_ = false;
  int64_t origin_ticks_ = 0, origin_us_ = 0;
  std::deque<Point> earliest_;    // of each bin, oldest first
  std::deque<Bracket> brackets_;  // oldest first
  double bin_lateness_s_ = 0;     // smallest in the bin that runs, against the map
  int late_bins_ = 0;             // bins in a row that were late by a jump throughout
  int64_t samples_ = 0;
  int jumps_ = 0;
  std::optional<ClockMap> map_;
};

}  // namespace selvedge::rig
