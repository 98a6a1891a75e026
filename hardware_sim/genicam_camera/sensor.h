// The sensor of a simulated camera: exposes freely at its rate or on triggers, on its own clock, and hands each frame
// on.
//
// The time stamp is the start of exposure: device_s = host_s + clock_offset_s + clock_drift_ppm·1e-6·(host_s − host_s
// at start), or the master's clock while it follows one. Reads rate, exposure and trigger from the registers
// (features.h).
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "hardware_sim/genicam_camera/register_file.h"

namespace selvedge::sim {

// Fills width_px·height_px bytes; exposure_mid_host_s on CLOCK_MONOTONIC. False: no image, no frame.
using ImageSource = std::function<bool(double exposure_mid_host_s, uint8_t* pixels)>;

struct SensorOptions {
  int width_px, height_px;
  double readout_s;        // between the end of exposure and the frame
  double clock_offset_s;   // device minus host at start
  double clock_drift_ppm;  // positive: the device clock is fast
};

struct SensorFrame {
  int64_t number = 0;  // since acquisition was started, from 1
  int64_t ticks = 0;   // start of exposure, nanoseconds of the device clock
  std::vector<uint8_t> pixels;
};

class Sensor {
 public:
  // on_frame: on the sensor's own thread; the next exposure begins after it returns, or at its due time.
  Sensor(const SensorOptions& options, const RegisterFile& registers, ImageSource image_at,
         std::function<void(SensorFrame&&)> on_frame);
  ~Sensor();
  Sensor(const Sensor&) = delete;
  Sensor& operator=(const Sensor&) = delete;

  void start();
  void stop();
  bool running() const { return running_; }
  // Counted as missed where no trigger is awaited, or within an exposure and its read-out, as on a real sensor.
  void trigger(double host_s);

  int64_t ticks(double host_s) const;
  void step_clock(double by_s);
  void reset_clock();
  // From from_host_s on the clock is the host's plus master_offset_s; run_freely goes on by itself from there.
  void follow_master(double from_host_s, double master_offset_s);
  void run_freely();
  bool follows_master(double host_s) const;

  int64_t frames() const { return frames_; }
  int64_t missed_exposures() const { return missed_; }  // due or triggered while the sensor was busy

 private:
  struct Master {
    double from_host_s, offset_s;
  };
  void expose_frames();
  bool wait_for_start(double& start_host_s);
  void expose(double start_host_s);
  double busy_s() const;
  bool triggered() const;
  int64_t ticks_locked(double host_s) const;

  const SensorOptions options_;
  const RegisterFile& registers_;
  const ImageSource image_at_;
  const std::function<void(SensorFrame&&)> on_frame_;
  std::atomic<bool> ending_{false}, running_{false};
  std::atomic<int64_t> frames_{0}, missed_{0};

  mutable std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  std::deque<double> triggers_;  // host times of edges not yet exposed
  double next_free_start_s_ = 0;
  double busy_until_s_ = 0;  // end of the exposure and read-out of the last trigger
  int64_t number_ = 0;
  double clock_start_host_s_, clock_base_s_;  // device_s = clock_base_s + (host_s − start)·(1 + drift)
  std::optional<Master> master_;

  std::thread thread_;  // last: it uses all above
};

}  // namespace selvedge::sim
