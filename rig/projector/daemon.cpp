#include "rig/projector/daemon.h"

#include <deque>
#include <mutex>
#include <thread>

#include <selvedge_rig/projector_command_t.hpp>
#include <selvedge_rig/projector_status_t.hpp>
#include <spdlog/spdlog.h>

#include "files/bad_input.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "rig/device_status.h"
#include "rig/wire/socket.h"

namespace selvedge::projector {

namespace {

using selvedge_rig::device_status_t;
using selvedge_rig::projector_command_t;
using selvedge_rig::projector_status_t;

Pattern to_pattern(const projector_command_t& command) {
  Pattern pattern;
  switch (command.kind) {
    case projector_command_t::KIND_OFF: return pattern;
    case projector_command_t::KIND_SOLID: pattern.kind = PatternKind::solid; break;
    case projector_command_t::KIND_STRIPES: pattern.kind = PatternKind::stripes; break;
    case projector_command_t::KIND_GRAY_CODE: pattern.kind = PatternKind::gray_code; break;
    default: refuse("projector command", "kind {}, expected 0 to 3", command.kind);
  }
  if (!(command.level >= 0 && command.level <= 1))
    refuse("projector command", "level {}, expected 0 to 1", command.level);
  pattern.orientation =
      command.orientation == projector_command_t::COLUMNS ? Orientation::vertical : Orientation::horizontal;
  pattern.level = command.level;
  pattern.period_px = command.period_px;
  pattern.duty = command.duty;
  pattern.first_bright_row_px = command.first_bright_px;
  pattern.bit = command.bit;
  pattern.inverted = command.inverted != 0;
  return canonical(pattern);
}

// What shows, as it goes onto the bus. Also the memory for a projector that comes back.
class Showing {
 public:
  Showing(rig::Bus& bus, const std::string& device, const ProjectorConfiguration& configuration)
      : bus_(bus), channel_(rig::channel(device, rig::kPattern)) {
    message_.width_px = configuration.width_px;
    message_.height_px = configuration.height_px;
    message_.utime = rig::host_now_us();
  }

  const Pattern& pattern() const { return pattern_; }

  void obey(Projector& projector, const projector_command_t& command) {
    try {
      const Pattern wanted = to_pattern(command);
      projector.show(wanted);
      pattern_ = wanted;
      accept(command);
    } catch (const BadInput& error) { deny(command, error.what()); } catch (const ProjectorFault& error) {
      deny(command, error.what());
    }
    publish();
  }

  void publish() {
    bus_.publish(channel_, message_);
    published_us_ = rig::host_now_us();
  }
  void publish_if_due() {
    if (rig::host_now_us() - published_us_ > 500000) publish();
  }

 private:
  void accept(const projector_command_t& command) {
    message_.utime = rig::host_now_us();
    message_.command_id = command.command_id;
    message_.kind = command.kind;
    message_.orientation = command.orientation;
    message_.period_px = command.period_px;
    message_.duty = command.duty;
    message_.first_bright_px = command.first_bright_px;
    message_.bit = command.bit;
    message_.inverted = command.inverted;
    message_.refused = 0;
    message_.message.clear();
  }
  void deny(const projector_command_t& command, const std::string& why) {
    spdlog::warn("projector: command {} refused: {}", command.command_id, why);
    message_.command_id = command.command_id;
    message_.refused = 1;
    message_.message = why;
  }

  rig::Bus& bus_;
  std::string channel_;
  Pattern pattern_;
  projector_status_t message_{};
  int64_t published_us_ = 0;
};

// Commands from the bus thread to the daemon's. A flood drops the oldest.
class Commands {
 public:
  void push(const projector_command_t& command) {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= 64) {
      waiting_.pop_front();
      ++dropped_;
    }
    waiting_.push_back(command);
  }
  std::optional<projector_command_t> pop() {
    const std::lock_guard lock(mutex_);
    if (waiting_.empty()) return std::nullopt;
    const auto command = waiting_.front();
    waiting_.pop_front();
    return command;
  }
  int64_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  mutable std::mutex mutex_;
  std::deque<projector_command_t> waiting_;
  int64_t dropped_ = 0;
};

void serve(Projector& projector, Commands& commands, Showing& showing, rig::DeviceStatus& status,
           const std::atomic<bool>& stopping) {
  projector.show(showing.pattern());
  status.set_state(device_status_t::RUNNING, "");
  double checked_s = rig::host_now_s();
  while (!stopping) {
    while (const auto command = commands.pop()) {
      showing.obey(projector, *command);
      status.delivered();
    }
    if (rig::host_now_s() - checked_s > 0.5) {
      checked_s = rig::host_now_s();
      projector.check();
      showing.publish_if_due();
    }
    status.set_refused(commands.dropped());
    status.publish_if_due();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  projector.show({});
}

void read_dlpc350(rig::Section& keys, ProjectorOptions& device) {
  device.transport = keys.text("transport", device.transport);
  if (device.transport != "usb" && !device.transport.starts_with("unix:"))
    refuse(keys.where() + " transport", "found \"{}\", expected \"usb\" or \"unix:PATH\"", device.transport);
  device.flash_table = keys.text("flash_table", "");
  device.exposure_s = keys.number("exposure_s", device.exposure_s, 235e-6, 2, "s");
}

void read_window(rig::Section& keys, ProjectorConfiguration& result) {
  WindowOptions& window = result.window;
  window.screen = keys.text("screen", window.screen);
  window.monitor = static_cast<int>(keys.integer("monitor", window.monitor, 0, 63, ""));
  window.gamma = keys.number("gamma", window.gamma, 0.2, 5, "");
  window.settle_s = keys.number("settle_s", window.settle_s, 0, 2, "s");
  window.width_px = result.width_px;
  window.height_px = result.height_px;
}

}  // namespace

ProjectorConfiguration read_configuration(rig::Section keys) {
  ProjectorConfiguration result;
  result.backend = keys.choice("backend", result.backend, {"dlpc350", "window"});
  result.width_px = static_cast<int>(keys.integer("width_px", result.width_px, 1, 8192, "px"));
  result.height_px = static_cast<int>(keys.integer("height_px", result.height_px, 1, 8192, "px"));
  const double timeout_s = keys.number("reply_timeout_s", result.device.reply_timeout_s, 0.01, 10, "s");
  result.device.reply_timeout_s = result.window.reply_timeout_s = timeout_s;
  if (result.backend == "window") read_window(keys, result);
  else read_dlpc350(keys, result.device);
  keys.finish();
  return result;
}

std::unique_ptr<Projector> open(const ProjectorConfiguration& configuration) {
  return configuration.backend == "window" ? open_window(configuration.window) : open_dlpc350(configuration.device);
}

void run_daemon(const rig::Configuration& configuration, const std::atomic<bool>& stopping, const std::string& device) {
  const ProjectorConfiguration own = read_configuration(configuration.section(device));
  Commands commands;  // outlives the bus, whose thread fills it
  rig::Bus bus(configuration.bus());
  bus.subscribe<projector_command_t>(rig::channel(device, rig::kCommand),
                                     [&](const projector_command_t& command) { commands.push(command); });
  bus.start();
  rig::DeviceStatus status(bus, device);
  Showing showing(bus, device, own);
  bool fitted = false;  // the configuration, to the device, once
  while (!stopping) {
    try {
      const auto projector = open(own);
      fitted = true;
      spdlog::info("{}: {}", device, projector->description());
      serve(*projector, commands, showing, status, stopping);
    } catch (const wire::Disconnected& error) {
      status.set_state(device_status_t::LOST, error.what());
    } catch (const ProjectorFault& error) {
      status.set_state(device_status_t::DEGRADED, error.what());
    } catch (const BadInput& error) {
      if (!fitted) throw;
      status.set_state(device_status_t::LOST, error.what());  // somebody changed the device, who may change it back
    }
    for (int i = 0; i < 5 && !stopping; ++i) {
      status.publish_if_due();
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  status.set_state(device_status_t::STOPPED, "");
}

}  // namespace selvedge::projector
