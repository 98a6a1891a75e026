#include "hardware_sim/genicam_camera/sensor.h"

#include <cerrno>
#include <chrono>
#include <cmath>

#include <time.h>

#include "hardware_sim/genicam_camera/features.h"
#include "rig/clock.h"

namespace selvedge::sim {

namespace {

using rig::host_now_s;

void sleep_until_host(double host_s) {
  timespec due{};
  due.tv_sec = static_cast<time_t>(std::floor(host_s));
  due.tv_nsec = static_cast<long>((host_s - std::floor(host_s)) * 1e9);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) == EINTR) {}
}

}  // namespace

Sensor::Sensor(const SensorOptions& options, const RegisterFile& registers, ImageSource image_at,
               std::function<void(SensorFrame&&)> on_frame)
    : options_(options), registers_(registers), image_at_(std::move(image_at)), on_frame_(std::move(on_frame)),
      clock_start_host_s_(host_now_s()), clock_base_s_(clock_start_host_s_ + options.clock_offset_s),
      thread_([this] { expose_frames(); }) {}

Sensor::~Sensor() {
  ending_ = true;
  changed_.notify_all();
  thread_.join();
}

void Sensor::start() {
  const std::lock_guard lock(mutex_);
  triggers_.clear();
  number_ = 0;
  next_free_start_s_ = host_now_s();
  busy_until_s_ = 0;
  running_ = true;
  changed_.notify_all();
}

void Sensor::stop() {
  const std::lock_guard lock(mutex_);
  running_ = false;
  changed_.notify_all();
}

double Sensor::busy_s() const { return registers_.real(reg::kExposure_us) * 1e-6 + options_.readout_s; }
bool Sensor::triggered() const { return registers_.word(reg::kTriggerMode) == 1; }

void Sensor::trigger(double host_s) {
  const double busy_s = this->busy_s();
  const std::lock_guard lock(mutex_);
  if (!running_ || !triggered() || host_s < busy_until_s_) {
    ++missed_;
    return;
  }
  busy_until_s_ = host_s + busy_s;
  triggers_.push_back(host_s);
  changed_.notify_all();
}

void Sensor::expose_frames() {
  double start_host_s = 0;
  while (!ending_)
    if (wait_for_start(start_host_s)) expose(start_host_s);
}

// True with the host time at which an exposure starts (or started); false to look again.
bool Sensor::wait_for_start(double& start_host_s) {
  std::unique_lock lock(mutex_);
  if (!running_ || (triggered() && triggers_.empty())) {
    changed_.wait_for(lock, std::chrono::milliseconds(20));
    return false;
  }
  if (triggered()) {
    start_host_s = triggers_.front();
    triggers_.pop_front();
    return true;
  }
  // Running free: a source of images that is too slow costs whole periods, never the rhythm.
  const double period_s = 1 / registers_.real(reg::kFrameRate_hz);
  while (next_free_start_s_ + busy_s() + period_s < host_now_s()) {
    next_free_start_s_ += period_s;
    ++missed_;
  }
  start_host_s = next_free_start_s_;
  next_free_start_s_ += period_s;
  return true;
}

void Sensor::expose(double start_host_s) {
  const double exposure_s = registers_.real(reg::kExposure_us) * 1e-6;
  SensorFrame frame;
  frame.pixels.resize(static_cast<size_t>(options_.width_px) * static_cast<size_t>(options_.height_px));
  frame.ticks = ticks(start_host_s);
  sleep_until_host(start_host_s + exposure_s);
  if (!running_ || !image_at_(start_host_s + 0.5 * exposure_s, frame.pixels.data())) return;
  sleep_until_host(start_host_s + exposure_s + options_.readout_s);
  {
    const std::lock_guard lock(mutex_);
    if (!running_) return;
    frame.number = ++number_;
    if (registers_.word(reg::kAcquisitionMode) == 1) running_ = false;
    ++frames_;
  }
  on_frame_(std::move(frame));
}

int64_t Sensor::ticks_locked(double host_s) const {
  if (master_ && host_s >= master_->from_host_s) return std::llround((host_s + master_->offset_s) * 1e9);
  return std::llround((clock_base_s_ + (host_s - clock_start_host_s_) * (1 + options_.clock_drift_ppm * 1e-6)) * 1e9);
}

int64_t Sensor::ticks(double host_s) const {
  const std::lock_guard lock(mutex_);
  return ticks_locked(host_s);
}

void Sensor::step_clock(double by_s) {
  const std::lock_guard lock(mutex_);
  clock_base_s_ += by_s;
}

void Sensor::reset_clock() {
  const std::lock_guard lock(mutex_);
  clock_start_host_s_ = host_now_s();
  clock_base_s_ = 0;
}

void Sensor::follow_master(double from_host_s, double master_offset_s) {
  const std::lock_guard lock(mutex_);
  master_ = {from_host_s, master_offset_s};
}

void Sensor::run_freely() {
  const std::lock_guard lock(mutex_);
  const double now_s = host_now_s();
  if (master_ && now_s >= master_->from_host_s) {
    clock_base_s_ = 1e-9 * static_cast<double>(ticks_locked(now_s));
    clock_start_host_s_ = now_s;
  }
  master_.reset();
}

bool Sensor::follows_master(double host_s) const {
  const std::lock_guard lock(mutex_);
  return master_ && host_s >= master_->from_host_s;
}

}  // namespace selvedge::sim
