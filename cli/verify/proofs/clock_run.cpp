#include "cli/verify/proofs/clock_run.h"

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <optional>
#include <random>
#include <stdexcept>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <selvedge_rig/clock_map_t.hpp>
#include <selvedge_rig/corner_sample_t.hpp>

#include "calib/blobs.h"
#include "calib/time_offset.h"
#include "hardware_sim/datastream_server/datastream_server.h"
#include "hardware_sim/gige_camera/gige_camera.h"
#include "hardware_sim/natnet_server/natnet_server.h"
#include "rig/camera/daemon.h"
#include "rig/camera/frame_ring.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "rig/clock_message.h"
#include "rig/configuration.h"
#include "rig/tracker/daemon.h"
#include "station/free_addresses.h"

namespace selvedge::cli {

namespace {

constexpr int kDiscWidth_px = 240, kDiscHeight_px = 180;
constexpr double kFocal_px = 300, kDistance_m = 1.5, kDisc_px = 3.5;  // of the Gaussian spot
constexpr double kFrames_hz = 60, kSamples_hz = 120;
constexpr double kLatency_s = 0.03;
constexpr double kLongestSilence_s = 20;
constexpr int kDiscs = 4;

// At (0, −kDistance, 0), looking along y.
geometry::Projection disc_camera() {
  geometry::Projection camera;
  const double cx = 0.5 * (kDiscWidth_px - 1), cy = 0.5 * (kDiscHeight_px - 1), d = kDistance_m;
  camera.matrix << kFocal_px, cx, 0, cx * d, 0, cy, -kFocal_px, cy * d, 0, 1, 0, d;
  camera.width_px = kDiscWidth_px;
  camera.height_px = kDiscHeight_px;
  return camera;
}

// Place of a disc at host time t; numbered left to right, the upper row first.
Eigen::Vector3d disc_at(int disc, double t) {
  const Eigen::Vector3d place(disc % 2 == 0 ? -0.15 : 0.15, 0, disc < 2 ? 0.12 : -0.12);
  const double angle = 2 * M_PI * 1.2 * t;
  return place + Eigen::Vector3d(0.08 * std::sin(angle), 0.03 * std::cos(0.7 * angle), 0.05 * std::sin(1.3 * angle));
}

void draw_discs(const geometry::Projection& camera, double t, uint8_t* pixels) {
  std::array<Eigen::Vector2d, kDiscs> centres;
  for (int disc = 0; disc < kDiscs; ++disc)
    centres[static_cast<size_t>(disc)] = geometry::project(camera, disc_at(disc, t));
  for (int row = 0; row < kDiscHeight_px; ++row)
    for (int column = 0; column < kDiscWidth_px; ++column) {
      double grey = 10;
      for (const Eigen::Vector2d& centre : centres) {
        const double square = (centre - Eigen::Vector2d(column, row)).squaredNorm() / (2 * kDisc_px * kDisc_px);
        if (square < 12) grey += 230 * std::exp(-square);
      }
      pixels[row * kDiscWidth_px + column] = static_cast<uint8_t>(std::min(255.0, grey + 0.5));
    }
}

std::vector<hardware_sim::NamedPoint> disc_points(double t) {
  std::vector<hardware_sim::NamedPoint> points;
  for (int disc = 0; disc < kDiscs; ++disc) points.push_back({"discs", fmt::format("d{}", disc), disc_at(disc, t)});
  return points;
}

// When a simulated system took its samples, by frame number; the daemons never see it.
class SampleTimes {
 public:
  std::vector<hardware_sim::NamedPoint> look(double t) {
    const std::lock_guard lock(mutex_);
    times_s_.push_back(t);
    return disc_points(t);
  }
  double of_frame(int64_t number) const {
    const std::lock_guard lock(mutex_);
    return times_s_.at(static_cast<size_t>(number - 1));
  }

 private:
  mutable std::mutex mutex_;
  std::vector<double> times_s_;
};

// The newest of what one tracker's daemon says, and everything since `keep_from_s`.
struct TrackerWord {
  std::optional<selvedge_rig::clock_map_t> clock;
  std::vector<selvedge_rig::corner_sample_t> samples;
};

class ClockBench {
 public:
  explicit ClockBench(const ClockRunOptions& options)
      : options_(options), camera_address_(station::free_camera_address()), picture_(disc_camera()),
        vicon_(
            [&] {
    hardware_sim::DatastreamServerOptions o;
    o.rate_hz = kSamples_hz;
    o.latency_s = kLatency_s;
    o.stated_latency_s = kLatency_s - options.delay_s;
    o.awake_s = 2e-4;
    o.seed = options.seed;
    return o;
            }(),
            [this](double t) { return vicon_times_.look(t); }),
  optitrack_(
      [&] {
    hardware_sim::NatnetServerOptions o;
    o.rate_hz = kSamples_hz;
    o.clock_offset_s = options.clock_offset_s;
    o.clock_drift_ppm = options.clock_drift_ppm;
    o.seed = options.seed + 1000;
    return o;
      }(),
      [this](double t) { return optitrack_times_.look(t); }),
  camera_(
      [&] {
    sim::GigeCameraOptions o;
    o.address = camera_address_;
    o.width_px = kDiscWidth_px;
    o.height_px = kDiscHeight_px;
    o.clock_offset_s = options.clock_offset_s;
    o.clock_drift_ppm = options.clock_drift_ppm;
    o.seed = options.seed;
    return o;
      }(),
      [this](double t, uint8_t* pixels) {
    draw_discs(picture_, t, pixels);
    return true;
  }),
  configuration_(rig::Configuration::parse(
      fmt::format(
          "[bus]\nport = {}\n[camera]\naddress = \"{}\"\nrate_hz = {}\npacket_size_bytes = 9000\npreview_rate_hz = 0\n"
          "[vicon]\nport = {}\n[optitrack]\nbackend = \"natnet\"\nport = {}\n",
          station::free_bus_port(), camera_address_, kFrames_hz, vicon_.port(), optitrack_.port()),
      "prove rig", {"bus", "camera", "vicon", "optitrack"})),
  bus_(configuration_.bus()) {
    bus_.subscribe<selvedge_rig::clock_map_t>(rig::channel("camera", rig::kClock), [this](const auto& message) {
      const std::lock_guard lock(mutex_);
      camera_clock_ = message;
    });
    hear("vicon", vicon_word_);
    hear("optitrack", optitrack_word_);
    bus_.start();
    const auto start = [this](auto run, const char* device) {
      daemons_.emplace_back([this, run, device] { run(configuration_, stopping_, device); });
    };
    start(camera::run_daemon, "camera");
    start(tracker::run_daemon, "vicon");
    start(tracker::run_daemon, "optitrack");
  }
  ~ClockBench() {
    stopping_ = true;
    for (std::thread& daemon : daemons_) daemon.join();
    camera::FrameRingWriter::remove(camera::ring_name(configuration_.bus().port, "camera"));
  }

  ClockRun run() {
    read_frames();
    const std::lock_guard lock(mutex_);
    if (!camera_clock_ || !vicon_word_.clock || !optitrack_word_.clock || vicon_word_.samples.empty() ||
        optitrack_word_.samples.empty() || !by_arrivals_->map())
      throw std::runtime_error("prove rig: a daemon said nothing");
    ClockRun result;
    const rig::ClockMap map = rig::from_message(*camera_clock_);
    result.camera = camera_error(map);
    result.camera_drift_error_ppm = map.drift_ppm + options_.clock_drift_ppm / (1 + 1e-6 * options_.clock_drift_ppm);
    result.camera_by_arrivals = camera_error(*by_arrivals_->map());
    result.optitrack = tracker_error(optitrack_word_, optitrack_times_, 0);
    result.vicon = tracker_error(vicon_word_, vicon_times_, options_.delay_s);
    result.delay = delay_error(result);
    return result;
  }

 private:
  void hear(const std::string& device, TrackerWord& word) {
    bus_.subscribe<selvedge_rig::clock_map_t>(rig::channel(device, rig::kClock), [this, &word](const auto& message) {
      const std::lock_guard lock(mutex_);
      word.clock = message;
    });
    bus_.subscribe<selvedge_rig::corner_sample_t>(rig::channel(device, rig::kCorners),
                                                  [this, &word](const auto& message) {
      const std::lock_guard lock(mutex_);
      word.samples.push_back(message);
    });
  }

  std::unique_ptr<camera::FrameRingReader> open_ring() const {
    const std::string name = camera::ring_name(configuration_.bus().port, "camera");
    for (const double end_s = rig::host_now_s() + kLongestSilence_s; rig::host_now_s() < end_s;) {
      try {
        return std::make_unique<camera::FrameRingReader>(name);
      } catch (const std::runtime_error&) {  // not there yet
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
    }
    throw std::runtime_error("prove rig: the camera's daemon made no ring");
  }

  void read_frames() {
    const auto reader = open_ring();
    rig::ClockOptions arrivals;
    arrivals.minimum_delay_s = sim::GigeCameraOptions().readout_s;
    arrivals.minimum_delay_sd_s = 5e-4;
    by_arrivals_.emplace(arrivals);
    const double watch_from_s = rig::host_now_s() + options_.settle_s, end_s = watch_from_s + options_.watch_s;
    camera::RingFrame frame;
    while (rig::host_now_s() < end_s) {
      if (!reader->next(frame, kLongestSilence_s)) throw std::runtime_error("prove rig: frames stopped coming");
      by_arrivals_->add(frame.head.device_ticks + std::llround(1e9 * frame.head.exposure_s), frame.head.arrival_us);
      if (rig::host_now_s() > watch_from_s) note_discs(frame);
    }
  }

  void note_discs(const camera::RingFrame& frame) {
    const auto pixels = Eigen::Map<const Eigen::Matrix<uint8_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        frame.pixels.data(), kDiscHeight_px, kDiscWidth_px);
    const auto blobs = calib::find_blobs(pixels);
    if (blobs.size() != kDiscs) return;
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const auto& blob : blobs) middle += blob.centre / kDiscs;
    for (const auto& blob : blobs) {
      const int disc = (blob.centre.x() > middle.x() ? 1 : 0) + (blob.centre.y() > middle.y() ? 2 : 0);
      sightings_.push_back({1e-6 * static_cast<double>(frame.head.utime), disc, blob.centre});
    }
  }

  Found camera_error(const rig::ClockMap& map) const {
    const double now_s = rig::host_now_s();
    return {map.host_s(camera_.device_ticks(now_s)) - now_s, map.uncertainty_s};
  }

  // late_s: what the samples must be late by.
  static Found tracker_error(const TrackerWord& word, const SampleTimes& truth, double late_s) {
    const auto& sample = word.samples.back();
    return {1e-6 * static_cast<double>(sample.utime) - truth.of_frame(sample.frame_number) - late_s,
            word.clock->uncertainty_s};
  }

  Found delay_error(const ClockRun& clocks) const {
    if (sightings_.empty()) throw std::runtime_error("prove rig: no frame shows the discs");
    const double from_s = sightings_.front().time_s - 1, to_s = sightings_.back().time_s + 1;
    std::vector<calib::MarkerTrack> tracks;
    for (int disc = 0; disc < kDiscs; ++disc) {
      calib::MarkerTrack& track = tracks.emplace_back();
      track.marker = disc;
      const std::string name = fmt::format("d{}", disc);
      for (const auto& sample : vicon_word_.samples) {
        const double time_s = 1e-6 * static_cast<double>(sample.utime);
        if (time_s < from_s || time_s > to_s || (!track.time_s.empty() && time_s <= track.time_s.back())) continue;
        for (size_t i = 0; i < sample.name.size(); ++i) {
          if (sample.name[i] != name || sample.occluded[i]) continue;
          track.time_s.push_back(time_s);
          track.position.emplace_back(sample.x_m[i], sample.y_m[i], sample.z_m[i]);
        }
      }
    }
    const auto found = calib::estimate_time_offset(calib::from_projection(picture_), tracks, sightings_);
    if (!found.known) throw std::runtime_error("prove rig: the delay is left open: " + found.why);
    return {found.offset_s - options_.delay_s, std::hypot(found.sd_s, clocks.camera.sd_s, clocks.vicon.sd_s)};
  }

  const ClockRunOptions options_;
  const std::string camera_address_;
  const geometry::Projection picture_;
  SampleTimes vicon_times_, optitrack_times_;
  hardware_sim::DatastreamServer vicon_;
  hardware_sim::NatnetServer optitrack_;
  sim::GigeCamera camera_;
  const rig::Configuration configuration_;
  std::optional<rig::PassiveClock> by_arrivals_;
  std::vector<calib::TimedSighting> sightings_;
  std::mutex mutex_;  // guards the next three
  std::optional<selvedge_rig::clock_map_t> camera_clock_;
  TrackerWord vicon_word_, optitrack_word_;
  rig::Bus bus_;
  std::atomic<bool> stopping_{false};
  std::vector<std::thread> daemons_;
};

}  // namespace

ClockRun run_clocks(const ClockRunOptions& options) { return ClockBench(options).run(); }

}  // namespace selvedge::cli
