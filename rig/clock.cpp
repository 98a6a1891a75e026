#include "rig/clock.h"

#include <algorithm>
#include <cmath>

#include <time.h>

namespace selvedge::rig {

namespace {

constexpr int kLateBinsOfAJump = 8;  // a stall is over sooner than this many bins
constexpr double kEnvelopeFactor = 7;
constexpr double kHostResolution_s = 1e-6;
constexpr int kFewestBrackets = 4;
constexpr double kLongestUnbinned_s = 1;  // device time may step back this far (reordered packets)

}  // namespace

int64_t host_now_us() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t{now.tv_sec} * 1000000 + now.tv_nsec / 1000;
}

double host_now_s() { return 1e-6 * static_cast<double>(host_now_us()); }

double ClockMap::host_s(int64_t ticks) const {
  return reference_host_s + static_cast<double>(ticks - reference_ticks) / ticks_per_s * (1 + drift_ppm * 1e-6);
}

int64_t ClockMap::host_us(int64_t ticks) const { return std::llround(host_s(ticks) * 1e6); }

PassiveClock::PassiveClock(const ClockOptions& options) : options_(options) {}

void PassiveClock::restart() {
  if (has_origin_) ++jumps_;
  has_origin_ = false;
  late_bins_ = 0;
  samples_ = 0;
  earliest_.clear();
  brackets_.clear();
  map_.reset();
}

// Origins keep the doubles small enough for nanoseconds.
PassiveClock::Point PassiveClock::relative(int64_t device_ticks, int64_t host_us) {
  if (!has_origin_) {
    has_origin_ = true;
    origin_ticks_ = device_ticks;
    origin_us_ = host_us;
  }
  return {static_cast<double>(device_ticks - origin_ticks_) / options_.ticks_per_s,
          static_cast<double>(host_us - origin_us_) * 1e-6};
}

int64_t PassiveClock::bin(double device_s) const { return static_cast<int64_t>(std::floor(device_s / options_.bin_s)); }

void PassiveClock::add(int64_t device_ticks, int64_t arrival_us) {
  // A sample that is early by more than jitter, or a device time that steps back, is a jump of the device's clock.
  const double late_s =
      map_ ? static_cast<double>(arrival_us) * 1e-6 - map_->host_s(device_ticks) - options_.minimum_delay_s : 0;
  if (late_s < -options_.jump_s) restart();
  Point point = relative(device_ticks, arrival_us);
  if (!earliest_.empty() && point.device_s < earliest_.back().device_s - kLongestUnbinned_s) {
    restart();
    point = relative(device_ticks, arrival_us);
  }
  point.host_s -= options_.minimum_delay_s;
  ++samples_;

  if (earliest_.empty() || bin(point.device_s) > bin(earliest_.back().device_s)) {
    // A bin is done. Lateness that never lets up for some bins is no stall: the device's clock stepped back. Where the
    // clock is read, the readings tell, and lateness is lateness.
    late_bins_ = bin_lateness_s_ > options_.jump_s ? late_bins_ + 1 : 0;
    bin_lateness_s_ = late_s;
    if (late_bins_ >= kLateBinsOfAJump && brackets_.empty()) {
      restart();
      point = relative(device_ticks, arrival_us);
      point.host_s -= options_.minimum_delay_s;
    }
    estimate();
    earliest_.push_back(point);
    while (earliest_.front().device_s < point.device_s - options_.window_s) earliest_.pop_front();
    return;
  }
  bin_lateness_s_ = std::min(bin_lateness_s_, late_s);
  Point& kept = earliest_.back();
  if (point.host_s - point.device_s < kept.host_s - kept.device_s) kept = point;
}

void PassiveClock::add_bracket(int64_t device_ticks, int64_t before_us, int64_t after_us) {
  if (map_) {
    const double predicted_s = map_->host_s(device_ticks);
    if (predicted_s < static_cast<double>(before_us) * 1e-6 - options_.jump_s ||
        predicted_s > static_cast<double>(after_us) * 1e-6 + options_.jump_s)
      restart();
  }
  const Point before = relative(device_ticks, before_us), after = relative(device_ticks, after_us);
  brackets_.push_back({before.device_s, before.host_s, after.host_s});
  while (brackets_.front().device_s < before.device_s - options_.window_s) brackets_.pop_front();
  ++samples_;
  estimate();
}

void PassiveClock::estimate() {
  const auto arrivals = from_arrivals();
  const auto brackets = from_brackets();
  if (brackets && (!arrivals || brackets->uncertainty_s < arrivals->uncertainty_s)) map_ = brackets;
  else if (arrivals) map_ = arrivals;
}

std::optional<ClockMap> PassiveClock::from_arrivals() const {
  if (earliest_.size() < 2) return std::nullopt;

  // Lower convex hull, left to right (Andrew's monotone chain), and the edge over the mean device time.
  std::vector<Point> hull;
  double mean_device_s = 0;
  for (const Point& point : earliest_) {
    mean_device_s += point.device_s / static_cast<double>(earliest_.size());
    while (hull.size() >= 2) {
      const Point& a = hull[hull.size() - 2];
      const Point& b = hull.back();
      const double turn =
          (b.device_s - a.device_s) * (point.host_s - a.host_s) - (b.host_s - a.host_s) * (point.device_s - a.device_s);
      if (turn > 0) break;
      hull.pop_back();
    }
    hull.push_back(point);
  }
  size_t right = 1;
  while (right + 1 < hull.size() && hull[right].device_s < mean_device_s) ++right;
  const Point &a = hull[right - 1], &b = hull[right];
  const double limit = options_.largest_drift_ppm * 1e-6;
  const double free_drift = (b.host_s - a.host_s) / (b.device_s - a.device_s) - 1;
  const double drift = std::clamp(free_drift, -limit, limit);

  double intercept_s = std::numeric_limits<double>::infinity(), lateness_s = 0;
  for (const Point& point : earliest_) intercept_s = std::min(intercept_s, point.host_s - (1 + drift) * point.device_s);
  for (const Point& point : earliest_) lateness_s += point.host_s - (1 + drift) * point.device_s - intercept_s;
  const double count = static_cast<double>(earliest_.size());
  lateness_s /= count;

  // The earliest of n delays of mean lateness m is itself m/n late; a line's end is worse off than its middle.
  // The factor comes from simulated delays (tests/rig/test_clock.cpp holds the coverage).
  double uncertainty_s = kEnvelopeFactor * lateness_s / count + 0.5 * kHostResolution_s;
  if (drift != free_drift) uncertainty_s += limit * (earliest_.back().device_s - earliest_.front().device_s);
  return to_map(intercept_s, drift, std::hypot(uncertainty_s, options_.minimum_delay_sd_s));
}

// Weighted line through the middles of the brackets. How a request's time splits between way and way back is
// unknown and the same each time, so half a bracket does not average down; the slope's error does.
std::optional<ClockMap> PassiveClock::from_brackets() const {
  if (brackets_.size() < kFewestBrackets) return std::nullopt;
  double weights = 0, mean_device_s = 0, mean_offset_s = 0, half_width_s = 0;
  const auto weight = [](const Bracket& bracket) { return 1 / std::pow(bracket.after_s - bracket.before_s + 1e-6, 4); };
  const auto offset = [](const Bracket& bracket) {
    return 0.5 * (bracket.before_s + bracket.after_s) - bracket.device_s;
  };
  for (const Bracket& bracket : brackets_) {
    weights += weight(bracket);
    mean_device_s += weight(bracket) * bracket.device_s;
    mean_offset_s += weight(bracket) * offset(bracket);
    half_width_s += weight(bracket) * 0.5 * (bracket.after_s - bracket.before_s + kHostResolution_s);
  }
  mean_device_s /= weights;
  mean_offset_s /= weights;
  double spread = 0, slope = 0;
  for (const Bracket& bracket : brackets_) {
    const double arm_s = bracket.device_s - mean_device_s;
    spread += weight(bracket) * arm_s * arm_s;
    slope += weight(bracket) * arm_s * (offset(bracket) - mean_offset_s);
  }
  const double limit = options_.largest_drift_ppm * 1e-6;
  const double drift = spread > 0 ? std::clamp(slope / spread, -limit, limit) : 0;
  // Where few narrow brackets set the slope, the newest sample lies far from them.
  double slope_variance = 0;
  for (const Bracket& bracket : brackets_) {
    const double arm_s = bracket.device_s - mean_device_s,
                 half_s = 0.5 * (bracket.after_s - bracket.before_s + kHostResolution_s);
    slope_variance += std::pow(weight(bracket) * arm_s * half_s, 2) / 3;
  }
  const double slope_sd = spread > 0 ? std::min(std::sqrt(slope_variance) / spread, limit) : limit;
  const double newest_s = std::max(brackets_.back().device_s, earliest_.empty() ? 0 : earliest_.back().device_s);
  const double uncertainty_s =
      std::hypot(half_width_s / weights / std::sqrt(3.0), slope_sd * (newest_s - mean_device_s));
  return to_map(mean_offset_s - drift * mean_device_s, drift, uncertainty_s);
}

ClockMap PassiveClock::to_map(double intercept_s, double drift, double uncertainty_s) const {
  ClockMap map;
  map.ticks_per_s = options_.ticks_per_s;
  map.reference_ticks = origin_ticks_;
  map.reference_host_s = static_cast<double>(origin_us_) * 1e-6 + intercept_s;
  map.drift_ppm = drift * 1e6;
  map.uncertainty_s = uncertainty_s;
  map.samples = samples_;
  map.jumps = jumps_;
  return map;
}

}  // namespace selvedge::rig
