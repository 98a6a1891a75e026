#include "capture/session/rig_client.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include <fmt/format.h>
#include <selvedge_rig/projector_command_t.hpp>

#include "files/bad_input.h"
#include "rig/arm/control_link.h"
#include "rig/channels.h"
#include "rig/clock.h"

namespace selvedge::session {

namespace {

using selvedge_rig::arm_status_t;
using selvedge_rig::corner_sample_t;
using selvedge_rig::device_status_t;
using selvedge_rig::projector_command_t;
using selvedge_rig::projector_status_t;

constexpr double kKept_s = 20;      // of samples that nobody took
constexpr double kSendAgain_s = 3;  // a datagram may get lost; the projector shows the same twice without harm
constexpr double kFrameSlice_s = 0.2;
constexpr int64_t kRemind_us = 500'000;

const char* state_text(int8_t state) {
  switch (state) {
    case device_status_t::STARTING: return "starting";
    case device_status_t::RUNNING: return "running";
    case device_status_t::DEGRADED: return "degraded";
    case device_status_t::LOST: return "lost";
    case device_status_t::STOPPED: return "stopped";
    default: return "in an unknown state";
  }
}

template <class Message>
void keep_newest(std::deque<Message>& queue, const Message& message) {
  queue.push_back(message);
  while (queue.size() > 1 && queue.front().utime < message.utime - static_cast<int64_t>(kKept_s * 1e6))
    queue.pop_front();
}

projector_command_t to_command(const projector::Pattern& pattern) {
  projector_command_t command{};
  command.orientation = pattern.orientation == projector::Orientation::vertical ? projector_command_t::COLUMNS
                                                                                : projector_command_t::ROWS;
  command.period_px = pattern.period_px;
  command.duty = pattern.duty;
  command.first_bright_px = pattern.first_bright_row_px;
  command.bit = pattern.bit;
  command.inverted = pattern.inverted;
  command.level = pattern.level;
  switch (pattern.kind) {
    case projector::PatternKind::off: command.kind = projector_command_t::KIND_OFF; break;
    case projector::PatternKind::solid: command.kind = projector_command_t::KIND_SOLID; break;
    case projector::PatternKind::stripes: command.kind = projector_command_t::KIND_STRIPES; break;
    case projector::PatternKind::gray_code: command.kind = projector_command_t::KIND_GRAY_CODE; break;
    case projector::PatternKind::phase_shift: refuse("projector", "phase-shifted patterns do not travel on the bus");
  }
  return command;
}

}  // namespace

RigClient::RigClient(const rig::Configuration& configuration)
    : bus_configuration_(configuration.bus()), has_arm_(configuration.has("arm")) {
  for (const char* needed : {"camera", "tracker", "projector"})
    if (!configuration.has(needed)) refuse("configuration", "no section [{}], which a session needs", needed);
  if (has_arm_) arm_socket_ = arm::control_socket(configuration);
  bus_ = std::make_unique<rig::Bus>(bus_configuration_);
  subscribe();
  bus_->start();
}

RigClient::~RigClient() { bus_.reset(); }

void RigClient::subscribe() {
  for (const std::string device : {"camera", "tracker", "projector", "arm"})
    bus_->subscribe<device_status_t>(rig::channel(device, rig::kStatus),
                                     [this, device](const device_status_t& message) {
      const std::lock_guard lock(mutex_);
      status_[device] = message;
      news_.notify_all();
    });
  // The newest message, and where there is a queue all until they are taken.
  const auto keep = [this]<class Message>(const std::string& channel, std::optional<Message>& newest, auto*... queue) {
    bus_->subscribe<Message>(channel, [this, &newest, queue...](const Message& message) {
      const std::lock_guard lock(mutex_);
      newest = message;
      (keep_newest(*queue, message), ...);
      news_.notify_all();
    });
  };
  keep(rig::channel("camera", rig::kClock), camera_clock_);
  keep(rig::channel("tracker", rig::kClock), tracker_clock_);
  keep(rig::channel("projector", rig::kPattern), pattern_);
  keep(rig::channel("tracker", rig::kCorners), corners_, &corner_queue_);
  keep(rig::channel("arm", rig::kArm), arm_, &arm_queue_);
  keep(rig::kOperatorAnswer, answer_);
}

std::string RigClient::last_words(const std::string& device) const {
  const std::lock_guard lock(mutex_);
  return words(device);
}

std::string RigClient::words(const std::string& device) const {
  const auto found = status_.find(device);
  if (found == status_.end()) return "its daemon says nothing";
  const double age_s = rig::host_now_s() - 1e-6 * static_cast<double>(found->second.utime);
  std::string text = fmt::format("it says that it is {}", state_text(found->second.state));
  if (!found->second.message.empty()) text += ": " + found->second.message;
  if (age_s > 2) text += fmt::format(" ({:.0f} s ago)", age_s);
  return text;
}

void RigClient::wait(const std::string& device, const std::string& what, double timeout_s,
                     const std::function<bool()>& ready) {
  std::unique_lock lock(mutex_);
  if (news_.wait_for(lock, std::chrono::duration<double>(timeout_s), ready)) return;
  throw DeviceFailed(fmt::format("{}: no {} within {:.0f} s; {}", device, what, timeout_s, words(device)));
}

bool RigClient::running(const std::string& device, std::string& missing) const {
  const auto found = status_.find(device);
  const bool fresh = found != status_.end() && found->second.utime > rig::host_now_us() - 5'000'000;
  if (fresh && (found->second.state == device_status_t::RUNNING || found->second.state == device_status_t::DEGRADED))
    return true;
  missing = device + ": " + words(device);
  return false;
}

void RigClient::open_ring(double until_s) {
  const std::string name = camera::ring_name(bus_configuration_.port, "camera");
  while (true) {
    try {
      ring_ = std::make_unique<camera::FrameRingReader>(name);
      width_px_ = ring_->width_px();
      height_px_ = ring_->height_px();
      return;
    } catch (const BadInput& error) {
      if (rig::host_now_s() > until_s) throw DeviceFailed(std::string("camera: ") + error.what());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

void RigClient::wait_until_running(double timeout_s, const std::function<void(const std::string&)>& waiting) {
  const double until_s = rig::host_now_s() + timeout_s;
  std::vector<std::string> devices = {"projector", "tracker", "camera"};
  if (has_arm_) devices.push_back("arm");
  for (const std::string& device : devices) {
    std::string missing;
    while (true) {
      std::unique_lock lock(mutex_);
      if (running(device, missing)) break;
      lock.unlock();
      waiting(missing);
      if (rig::host_now_s() > until_s) throw DeviceFailed(fmt::format("{} (waited {:.0f} s)", missing, timeout_s));
      lock.lock();
      news_.wait_for(lock, std::chrono::milliseconds(500));
    }
  }
  const double left_s = std::max(1.0, until_s - rig::host_now_s());
  wait("tracker", "sample", left_s, [this] { return corners_.has_value(); });
  wait("projector", "word on what it shows", left_s, [this] { return pattern_.has_value(); });
  waiting("camera: clock not known yet");
  wait("camera", "clock map", left_s, [this] { return camera_clock_ && std::isfinite(camera_clock_->uncertainty_s); });
  if (has_arm_) wait("arm", "state", left_s, [this] { return arm_.has_value(); });
  open_ring(until_s);
}

std::optional<Frame> RigClient::next_frame(double timeout_s) {
  const double until_s = rig::host_now_s() + timeout_s;
  do {
    if (!ring_ || ring_->replaced()) open_ring(until_s + 5);
    const int64_t missed_before = ring_->missed();
    if (!ring_->next(ring_frame_, std::clamp(until_s - rig::host_now_s(), 0.0, kFrameSlice_s))) continue;
    frames_lost_ += ring_->missed() - missed_before;
    const camera::RingHead& head = ring_frame_.head;
    if (!head.whole || !std::isfinite(head.uncertainty_s)) continue;
    if (last_number_ > 0 && head.frame_number > last_number_ + 1 && ring_->missed() == missed_before)
      frames_lost_ += head.frame_number - last_number_ - 1;
    last_number_ = head.frame_number;
    return Frame{head.frame_number, 1e-6 * static_cast<double>(head.utime), head.exposure_s, head.uncertainty_s,
                 ring_frame_.pixels};
  } while (rig::host_now_s() < until_s);
  return std::nullopt;
}

void RigClient::skip_to_newest_frame() {
  while (ring_ && ring_->next(ring_frame_, 0)) last_number_ = ring_frame_.head.frame_number;
}

Frame RigClient::first_frame_after(double host_s, double timeout_s) {
  const double until_s = rig::host_now_s() + timeout_s;
  while (rig::host_now_s() < until_s) {
    auto frame = next_frame(until_s - rig::host_now_s());
    if (frame && frame->mid_exposure_s - 0.5 * frame->exposure_s >= host_s + std::min(3 * frame->uncertainty_s, 0.02))
      return std::move(*frame);
  }
  const std::lock_guard lock(mutex_);
  throw DeviceFailed(fmt::format("camera: no frame within {:.0f} s; {}", timeout_s, words("camera")));
}

void RigClient::forget_samples() {
  const std::lock_guard lock(mutex_);
  corner_queue_.clear();
  arm_queue_.clear();
}

std::vector<corner_sample_t> RigClient::take_corners() {
  const std::lock_guard lock(mutex_);
  std::vector<corner_sample_t> taken(corner_queue_.begin(), corner_queue_.end());
  corner_queue_.clear();
  return taken;
}

std::vector<arm_status_t> RigClient::take_arm_states() {
  const std::lock_guard lock(mutex_);
  std::vector<arm_status_t> taken(arm_queue_.begin(), arm_queue_.end());
  arm_queue_.clear();
  return taken;
}

std::optional<arm_status_t> RigClient::arm_state() const {
  const std::lock_guard lock(mutex_);
  return arm_;
}

std::map<std::string, selvedge_rig::clock_map_t> RigClient::clocks() const {
  const std::lock_guard lock(mutex_);
  std::map<std::string, selvedge_rig::clock_map_t> clocks;
  if (camera_clock_) clocks["camera"] = *camera_clock_;
  if (tracker_clock_) clocks["tracker"] = *tracker_clock_;
  return clocks;
}

corner_sample_t RigClient::corners_after(double host_s, double timeout_s) {
  const auto after = static_cast<int64_t>(host_s * 1e6);
  corner_sample_t sample;
  wait("tracker", "sample", timeout_s, [&] {
    if (!corners_ || corners_->utime < after) return false;
    sample = *corners_;
    return true;
  });
  return sample;
}

double RigClient::tracker_rate_hz() const {
  const std::lock_guard lock(mutex_);
  return corners_ ? corners_->rate_hz : 0;
}

double RigClient::show(const projector::Pattern& pattern, double timeout_s) {
  projector_command_t command = to_command(projector::canonical(pattern));
  command.command_id = rig::host_now_us() * 16 + (++command_id_ % 16);  // no other session's
  const auto answered = [&] { return pattern_ && pattern_->command_id == command.command_id; };
  const double until_s = rig::host_now_s() + timeout_s;
  while (true) {
    command.utime = rig::host_now_us();
    bus_->publish(rig::channel("projector", rig::kCommand), command);
    const double left_s = until_s - rig::host_now_s();
    std::unique_lock lock(mutex_);
    if (news_.wait_for(lock, std::chrono::duration<double>(std::min(kSendAgain_s, left_s)), answered)) break;
    if (rig::host_now_s() >= until_s)
      throw DeviceFailed(
          fmt::format("projector: no answer to a pattern within {:.0f} s; {}", timeout_s, words("projector")));
  }
  const std::lock_guard lock(mutex_);
  if (pattern_->refused) throw DeviceFailed("projector: refuses the pattern: " + pattern_->message);
  return 1e-6 * static_cast<double>(pattern_->utime);
}

int RigClient::projector_width_px() const {
  const std::lock_guard lock(mutex_);
  return pattern_ ? pattern_->width_px : 0;
}

int RigClient::projector_height_px() const {
  const std::lock_guard lock(mutex_);
  return pattern_ ? pattern_->height_px : 0;
}

int64_t RigClient::ask(selvedge_rig::operator_prompt_t prompt) {
  prompt.utime = asked_us_ = reminded_us_ = rig::host_now_us();
  prompt.prompt_id = prompt_.prompt_id + 1;
  prompt_ = prompt;
  bus_->publish(rig::kOperatorPrompt, prompt_);
  return prompt_.prompt_id;
}

std::string RigClient::take_answer(int64_t prompt_id) {
  const std::lock_guard lock(mutex_);
  const auto given = std::exchange(answer_, std::nullopt);
  return given && given->prompt_id == prompt_id && given->utime >= asked_us_ ? given->answer : "";
}

void RigClient::remind() {
  const int64_t now_us = rig::host_now_us();
  if (prompt_.prompt_id == 0 || now_us - reminded_us_ < kRemind_us) return;
  reminded_us_ = now_us;
  bus_->publish(rig::kOperatorPrompt, prompt_);
}

void RigClient::publish_status(selvedge_rig::session_status_t status) {
  status.utime = rig::host_now_us();
  bus_->publish(rig::kSessionStatus, status);
}

std::optional<Eigen::Vector3d> marker(const corner_sample_t& sample, const std::string& name) {
  for (size_t i = 0; i < sample.name.size(); ++i) {
    if (sample.name[i] != name || sample.occluded[i]) continue;
    const Eigen::Vector3d position(sample.x_m[i], sample.y_m[i], sample.z_m[i]);
    if (position.allFinite()) return position;
  }
  return std::nullopt;
}

}  // namespace selvedge::session
