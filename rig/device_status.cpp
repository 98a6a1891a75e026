#include "rig/device_status.h"

#include <spdlog/spdlog.h>

#include "rig/channels.h"
#include "rig/clock.h"

namespace selvedge::rig {

namespace {
constexpr int64_t kInterval_us = 500000;
constexpr const char* kStateNames[] = {"starting", "running", "degraded", "lost", "stopped"};
}  // namespace

DeviceStatus::DeviceStatus(Bus& bus, const std::string& device) : bus_(bus), channel_(channel(device, kStatus)) {
  message_.device = device;
  message_.state = selvedge_rig::device_status_t::STARTING;
}

void DeviceStatus::set_state(int8_t state, const std::string& message) {
  if (state == message_.state && message == message_.message) return;
  const bool changed = state != message_.state;
  message_.state = state;
  message_.message = message;
  if (changed) spdlog::info("{}: {}{}{}", message_.device, kStateNames[state], message.empty() ? "" : ": ", message);
  publish();
}

void DeviceStatus::set_temperature_degc(double value) {
  message_.has_temperature = 1;
  message_.temperature_degc = value;
}

void DeviceStatus::publish_if_due() {
  if (host_now_us() - published_us_ >= kInterval_us) publish();
}

void DeviceStatus::publish() {
  const int64_t now_us = host_now_us();
  const double since_s = 1e-6 * static_cast<double>(now_us - published_us_);
  // A message right after another says nothing new of the rate.
  if (since_s > 0.1) {
    message_.rate_hz = static_cast<double>(message_.delivered - delivered_before_) / since_s;
    delivered_before_ = message_.delivered;
  }
  published_us_ = now_us;
  message_.utime = now_us;
  bus_.publish(channel_, message_);
}

}  // namespace selvedge::rig
