#include "rig/camera/daemon.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

#include <selvedge_rig/camera_command_t.hpp>
#include <selvedge_rig/frame_stamp_t.hpp>
#include <selvedge_rig/preview_t.hpp>
#include <spdlog/spdlog.h>

#include "files/bad_input.h"
#include "rig/camera/camera.h"
#include "rig/camera/frame_ring.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "rig/clock_message.h"
#include "rig/device_status.h"

namespace selvedge::camera {

namespace {

using selvedge_rig::camera_command_t;
using selvedge_rig::device_status_t;

constexpr double kClockPublished_s = 0.5;
constexpr double kFirstReadings_s = 5;  // the device's clock is read often at first, to have a map soon
constexpr double kEarlyReading_s = 0.1, kReading_s = 1;
constexpr int kReadingsPerTemperature = 5;
constexpr double kReopen_s = 0.5;

// Reads the device's clock and temperature on a thread of its own: a control packet that gets lost takes half a
// second to time out, and frames must not wait for it.
class Probe {
 public:
  explicit Probe(Camera& camera) : camera_(camera), thread_([this] { run(); }) {}
  ~Probe() {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }

  void take(std::vector<ClockReading>& readings, std::optional<double>& temperature_degc) {
    const std::lock_guard lock(mutex_);
    readings = std::exchange(readings_, {});
    temperature_degc = temperature_degc_;
  }

 private:
  void run() {
    const double start_s = rig::host_now_s();
    for (int round = 0;; ++round) {
      try {
        read(round % kReadingsPerTemperature == 0);
      } catch (const std::exception& error) {
        spdlog::warn("camera: {}", error.what());  // the frames tell whether the device is lost
      }
      const double pause_s = rig::host_now_s() - start_s < kFirstReadings_s ? kEarlyReading_s : kReading_s;
      std::unique_lock lock(mutex_);
      if (wake_.wait_for(lock, std::chrono::duration<double>(pause_s), [this] { return ending_; })) return;
    }
  }

  void read(bool temperature_too) {
    ClockReading reading;
    if (camera_.read_clock(reading)) {
      const std::lock_guard lock(mutex_);
      readings_.push_back(reading);
    }
    double temperature_degc = 0;
    if (temperature_too && camera_.read_temperature(temperature_degc)) {
      const std::lock_guard lock(mutex_);
      temperature_degc_ = temperature_degc;
    }
  }

  Camera& camera_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ending_ = false;
  std::vector<ClockReading> readings_;
  std::optional<double> temperature_degc_;
  std::thread thread_;
};

// Commands from the bus thread to the thread that owns the camera.
class CommandBox {
 public:
  void put(const camera_command_t& command) {
    const std::lock_guard lock(mutex_);
    commands_.push_back(command);
  }
  std::vector<camera_command_t> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(commands_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<camera_command_t> commands_;
};

rig::ClockOptions clock_options(const CameraConfiguration& configuration, double ticks_per_s) {
  rig::ClockOptions options;
  options.ticks_per_s = ticks_per_s;
  options.minimum_delay_s = configuration.minimum_delay_s;
  options.minimum_delay_sd_s = configuration.minimum_delay_sd_s;
  return options;
}

// Mean of blocks, so that a preview of fine stripes is grey and not moiré.
selvedge_rig::preview_t shrink(const uint8_t* pixels, int width_px, int height_px, int preview_width_px) {
  const int block = std::max(1, width_px / preview_width_px);
  selvedge_rig::preview_t preview{};
  preview.width = width_px / block;
  preview.height = height_px / block;
  preview.size = preview.width * preview.height;
  preview.grey.reserve(static_cast<size_t>(preview.size));
  for (int row = 0; row < preview.height; ++row) {
    for (int column = 0; column < preview.width; ++column) {
      int sum = 0;
      for (int i = 0; i < block; ++i)
        for (int j = 0; j < block; ++j)
          sum += pixels[static_cast<size_t>(row * block + i) * static_cast<size_t>(width_px) +
                        static_cast<size_t>(column * block + j)];
      preview.grey.push_back(static_cast<uint8_t>(sum / (block * block)));
    }
  }
  return preview;
}

class Daemon {
 public:
  Daemon(const rig::Configuration& configuration, const std::string& device)
      : device_(device), configuration_(read_configuration(configuration.section(device))),
        ring_name_(ring_name(configuration.bus().port, device)), bus_(configuration.bus()), status_(bus_, device) {
    bus_.subscribe<camera_command_t>(rig::channel(device, rig::kCommand),
                                     [this](const camera_command_t& command) { commands_.put(command); });
    bus_.start();
  }

  void run(const std::atomic<bool>& stopping) {
    while (!stopping) {
      try {
        deliver(stopping);
      } catch (const CameraLost& error) {
        status_.set_state(device_status_t::LOST, error.what());
        const double again_s = rig::host_now_s() + kReopen_s;
        while (!stopping && rig::host_now_s() < again_s) {
          std::this_thread::sleep_for(std::chrono::milliseconds(20));
          status_.publish_if_due();
        }
      }
    }
    status_.set_state(device_status_t::STOPPED, "");
  }

 private:
  // One connection, from opening the device until it is lost or the daemon stops.
  void deliver(const std::atomic<bool>& stopping) {
    camera_.reset();  // lets go of the device before it is opened anew
    camera_ = open_camera(configuration_);
    const CameraInformation& information = camera_->information();
    spdlog::info("{}: {}, {}x{} px", device_, information.description, information.width_px, information.height_px);
    ring_.reset();
    ring_ = std::make_unique<FrameRingWriter>(ring_name_, information.width_px, information.height_px,
                                              configuration_.ring_frames);
    // A daemon that was killed left its last number in the ring; readers count on from it.
    if (last_number_ == 0) last_number_ = ring_->newest_frame_number();
    clock_ = rig::PassiveClock(clock_options(configuration_, information.ticks_per_s));
    begin(2);
    Probe probe(*camera_);
    while (!stopping) {
      camera_->next_frame(wait_s(), [this](const CameraFrame& frame) { accept(frame); });
      if (configuration_.trigger == CameraTrigger::off &&
          rig::host_now_s() - last_frame_s_ > configuration_.lost_after_s)
        throw CameraLost(fmt::format("no frame for {} s", configuration_.lost_after_s));
      take_probe(probe);
      for (const camera_command_t& command : commands_.take()) obey(command);
      status_.set_refused(bus_.count(rig::channel(device_, rig::kCommand)).undecodable + refused_);
      status_.publish_if_due();
    }
    camera_->stop();
  }

  // Commands wait for it, and a software trigger must not wait long.
  double wait_s() const { return configuration_.trigger == CameraTrigger::software ? 0.002 : 0.05; }

  void take_probe(Probe& probe) {
    std::vector<ClockReading> readings;
    std::optional<double> temperature_degc;
    probe.take(readings, temperature_degc);
    for (const ClockReading& reading : readings) clock_.add_bracket(reading.ticks, reading.before_us, reading.after_us);
    if (temperature_degc) status_.set_temperature_degc(*temperature_degc);
    if (clock_.map() && rig::host_now_s() - clock_published_s_ > kClockPublished_s) {
      auto message = rig::to_message(*clock_.map(), device_);
      bus_.publish(rig::channel(device_, rig::kClock), message);
      clock_published_s_ = rig::host_now_s();
    }
  }

  void accept(const CameraFrame& frame) {
    last_frame_s_ = rig::host_now_s();
    // A stream may open in the middle of a frame; what is not whole before the first whole one is no loss.
    if (!begun_ && !frame.whole) return;
    if (!begun_) number_offset_ = last_number_ == 0 ? 0 : last_number_ + step_ - frame.number;
    begun_ = true;
    const int64_t number = frame.number + number_offset_;
    const int64_t lost = number - last_number_ - 1 + (frame.whole ? 0 : 1);
    if (last_number_ > 0 && lost > 0) status_.dropped(lost);
    last_number_ = number;

    const RingHead head = stamp(frame, number);
    const int64_t slot_number = frame.whole ? ring_->write(head, frame.pixels) : 0;
    publish(head, slot_number);
    if (!frame.whole) return;
    status_.delivered();
    status_.set_state(device_status_t::RUNNING, "");
    publish_preview(frame, head);
  }

  // The device counts from 1 after each start; ours goes on by `step`, 2 where a hole shall show.
  void begin(int step) {
    step_ = step;
    begun_ = false;
    camera_->start();
    last_frame_s_ = rig::host_now_s();
  }

  RingHead stamp(const CameraFrame& frame, int64_t number) {
    const double ticks_per_s = camera_->information().ticks_per_s;
    const double exposure_s = configuration_.exposure_s;
    // Arrivals trail the end of the exposure, and a frame's ticks are its start.
    if (frame.whole) clock_.add(frame.ticks + std::llround(exposure_s * ticks_per_s), frame.arrival_us);
    RingHead head;
    head.frame_number = number;
    head.device_ticks = frame.ticks;
    head.arrival_us = frame.arrival_us;
    head.exposure_s = exposure_s;
    head.whole = frame.whole;
    if (const auto& map = clock_.map()) {
      head.utime = map->host_us(frame.ticks + std::llround(0.5 * exposure_s * ticks_per_s));
      head.uncertainty_s = std::hypot(map->uncertainty_s, camera_->information().stamp_sd_s);
    } else {
      head.utime = frame.arrival_us - std::llround((0.5 * exposure_s + configuration_.minimum_delay_s) * 1e6);
      head.uncertainty_s = std::numeric_limits<double>::infinity();
    }
    return head;
  }

  void publish(const RingHead& head, int64_t slot_number) {
    selvedge_rig::frame_stamp_t message{};
    message.utime = head.utime;
    message.frame_number = head.frame_number;
    message.device_ticks = head.device_ticks;
    message.arrival_utime = head.arrival_us;
    message.exposure_s = head.exposure_s;
    message.uncertainty_s = head.uncertainty_s;
    message.ring_slot_number = slot_number;
    message.whole = head.whole ? 1 : 0;
    bus_.publish(rig::channel(device_, rig::kStamp), message);
  }

  void publish_preview(const CameraFrame& frame, const RingHead& head) {
    if (configuration_.preview_rate_hz <= 0) return;
    const double now_s = rig::host_now_s();
    if (now_s - preview_s_ < 1 / configuration_.preview_rate_hz) return;
    preview_s_ = now_s;
    const CameraInformation& information = camera_->information();
    auto message = shrink(frame.pixels, information.width_px, information.height_px, configuration_.preview_width_px);
    message.utime = head.utime;
    message.frame_number = head.frame_number;
    bus_.publish(rig::channel(device_, rig::kPreview), message);
  }

  // What the device cannot do is refused and counted; the settings that stood before stay.
  void obey(const camera_command_t& command) {
    try {
      if (command.action == camera_command_t::SOFTWARE_TRIGGER) {
        if (configuration_.trigger != CameraTrigger::software) refuse(device_, "software trigger is not selected");
        camera_->software_trigger();
        return;
      }
      if (command.action != camera_command_t::SET) refuse(device_, "unknown action {}", command.action);
      set_trigger(command.trigger);
      if (command.rate_hz != 0) {
        if (configuration_.trigger != CameraTrigger::off) refuse(device_, "a triggered camera has no rate");
        camera_->set_rate(command.rate_hz);
        configuration_.rate_hz = command.rate_hz;
      }
      if (command.exposure_s != 0) {
        camera_->set_exposure(command.exposure_s);
        configuration_.exposure_s = command.exposure_s;
      }
    } catch (const BadInput& error) {
      ++refused_;
      spdlog::warn("{}: command refused: {}", device_, error.what());
    }
  }

  void set_trigger(int8_t wanted) {
    if (wanted == camera_command_t::TRIGGER_LEAVE) return;
    if (wanted < camera_command_t::TRIGGER_OFF || wanted > camera_command_t::TRIGGER_HARDWARE)
      refuse(device_, "unknown trigger {}", wanted);
    const auto trigger = static_cast<CameraTrigger>(wanted - camera_command_t::TRIGGER_OFF);
    if (trigger == configuration_.trigger) return;
    camera_->stop();
    camera_->set_trigger(trigger);
    configuration_.trigger = trigger;
    begin(1);
  }

  const std::string device_;
  CameraConfiguration configuration_;  // commands change rate, exposure and trigger
  const std::string ring_name_;
  CommandBox commands_;
  rig::Bus bus_;
  rig::DeviceStatus status_;
  std::unique_ptr<Camera> camera_;
  std::unique_ptr<FrameRingWriter> ring_;
  rig::PassiveClock clock_;
  bool begun_ = false;  // a whole frame came since the stream began
  int step_ = 1;        // of the frame number over the last beginning
  int64_t number_offset_ = 0, last_number_ = 0;
  int64_t refused_ = 0;  // commands
  double last_frame_s_ = 0, clock_published_s_ = 0, preview_s_ = 0;
};

}  // namespace

void run_daemon(const rig::Configuration& configuration, const std::atomic<bool>& stopping, const std::string& device) {
  Daemon(configuration, device).run(stopping);
}

}  // namespace selvedge::camera
