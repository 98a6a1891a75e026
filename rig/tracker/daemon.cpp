#include "rig/tracker/daemon.h"

#include <cmath>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <selvedge_rig/corner_sample_t.hpp>

#include "rig/channels.h"
#include "rig/clock.h"
#include "rig/clock_message.h"
#include "rig/device_status.h"
#include "rig/wire/socket.h"

namespace selvedge::tracker {

namespace {

using selvedge_rig::device_status_t;

// Frame numbers as the ticks of a clock. It starts anew with each connection.
class FrameClock {
 public:
  // Host time of the frame's capture, s: by the map once it stands, the raw estimate before.
  double capture_s(const TrackerFrame& frame) {
    if (frame.rate_hz <= 0) return frame.capture_s - frame.network_s;
    if (!clock_ || frame.rate_hz != rate_hz_) {
      rate_hz_ = frame.rate_hz;
      rig::ClockOptions options;
      options.ticks_per_s = rate_hz_;
      clock_.emplace(options);
    }
    clock_->add(frame.frame_number, std::llround(frame.capture_s * 1e6));
    map_ = clock_->map();
    if (!map_) return frame.capture_s - frame.network_s;
    // The way through the network is taken off behind the envelope, which would hold on to its first, longest value.
    map_->reference_host_s -= frame.network_s;
    map_->uncertainty_s = std::hypot(map_->uncertainty_s, frame.capture_sd_s);
    return map_->host_s(frame.frame_number);
  }
  const std::optional<rig::ClockMap>& map() const { return map_; }

 private:
  std::optional<rig::ClockMap> map_;
  double rate_hz_ = 0;
  std::optional<rig::PassiveClock> clock_;
};

selvedge_rig::corner_sample_t to_message(const TrackerFrame& frame, double capture_s) {
  selvedge_rig::corner_sample_t message{};
  message.utime = std::llround(capture_s * 1e6);
  message.frame_number = frame.frame_number;
  message.arrival_utime = std::llround(frame.arrival_s * 1e6);
  message.rate_hz = frame.rate_hz;
  message.latency_s = frame.latency_s;
  message.count = static_cast<int32_t>(frame.markers.size());
  for (const auto& marker : frame.markers) {
    message.name.push_back(marker.name);
    message.x_m.push_back(marker.position_m.x());
    message.y_m.push_back(marker.position_m.y());
    message.z_m.push_back(marker.position_m.z());
    message.occluded.push_back(marker.occluded ? 1 : 0);
  }
  return message;
}

// One connection, from the handshake until it breaks or the daemon stops.
class Connection {
 public:
  Connection(const TrackerConfiguration& configuration, rig::Bus& bus, rig::DeviceStatus& status,
             const std::string& device)
      : configuration_(configuration), bus_(bus), status_(status), device_(device),
        tracker_(connect_tracker(configuration)) {}

  void deliver(const std::atomic<bool>& stopping) {
    double last_frame_s = rig::host_now_s();
    while (!stopping) {
      const auto frame = tracker_->next(0.1);
      status_.set_refused(tracker_->refused());
      if (frame) {
        last_frame_s = frame->arrival_s;
        publish(*frame);
      } else if (rig::host_now_s() - last_frame_s > configuration_.silence_s) {
        throw wire::Disconnected(fmt::format("no frame for {} s", configuration_.silence_s));
      }
      status_.publish_if_due();
    }
  }

 private:
  void publish(const TrackerFrame& frame) {
    // Frames that never came count as lost; a number that steps back is a system that started anew.
    if (last_number_ && frame.frame_number > *last_number_) status_.dropped(frame.frame_number - *last_number_ - 1);
    last_number_ = frame.frame_number;
    auto message = to_message(frame, clock_.capture_s(frame));
    bus_.publish(rig::channel(device_, rig::kCorners), message);
    status_.delivered();
    status_.set_state(device_status_t::RUNNING, "");
    if (const auto map = clock_.map(); map && rig::host_now_s() - clock_published_s_ > 0.5) {
      auto clock_message = rig::to_message(*map, device_);
      bus_.publish(rig::channel(device_, rig::kClock), clock_message);
      clock_published_s_ = rig::host_now_s();
    }
  }

  const TrackerConfiguration& configuration_;
  rig::Bus& bus_;
  rig::DeviceStatus& status_;
  std::string device_;
  std::unique_ptr<Tracker> tracker_;
  FrameClock clock_;
  std::optional<std::int64_t> last_number_;
  double clock_published_s_ = 0;
};

}  // namespace

TrackerConfiguration read_configuration(rig::Section keys) {
  TrackerConfiguration result;
  result.backend = keys.choice("backend", result.backend, {"datastream", "natnet"});
  result.connection.host = keys.text("host", result.connection.host);
  result.connection.port = static_cast<int>(keys.integer("port", result.connection.port, 0, 65535));
  result.connection.connect_timeout_s =
      keys.number("connect_timeout_s", result.connection.connect_timeout_s, 0.1, 60, "s");
  result.connection.y_up = keys.flag("y_up", result.connection.y_up);
  result.silence_s = keys.number("silence_s", result.silence_s, 0.05, 60, "s");
  keys.finish();
  return result;
}

std::unique_ptr<Tracker> connect_tracker(const TrackerConfiguration& configuration) {
  return configuration.backend == "natnet" ? connect_natnet(configuration.connection)
                                           : connect_datastream(configuration.connection);
}

void run_daemon(const rig::Configuration& configuration, const std::atomic<bool>& stopping, const std::string& device) {
  const TrackerConfiguration own = read_configuration(configuration.section(device));
  rig::Bus bus(configuration.bus());
  rig::DeviceStatus status(bus, device);
  while (!stopping) {
    try {
      Connection(own, bus, status, device).deliver(stopping);
    } catch (const std::runtime_error& error) { status.set_state(device_status_t::LOST, error.what()); }
    for (int i = 0; i < 5 && !stopping; ++i) {
      status.publish_if_due();
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  status.set_state(device_status_t::STOPPED, "");
}

}  // namespace selvedge::tracker
