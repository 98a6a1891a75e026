#include "hardware_sim/usb3_camera/usb3_camera.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include <fmt/format.h>

#include "hardware_sim/usb3_camera/little_endian.h"
#include "hardware_sim/usb3_camera/registers.h"
#include "hardware_sim/usb_bus/usb_device.h"
#include "rig/clock.h"

namespace selvedge::sim {

namespace {

using hardware_sim::UsbBytes;

constexpr uint8_t kCommands = 0x01, kAnswers = 0x81, kFrames = 0x82;  // endpoints
constexpr uint32_t kCommandMagic = 0x43563355, kLeaderMagic = 0x4c563355, kTrailerMagic = 0x54563355;
constexpr size_t kHeaderBytes = 12;
constexpr uint16_t kRead = 0x0800, kWrite = 0x0802, kAckRequired = 1 << 14, kErrorBit = 0x8000;
constexpr uint16_t kImage = 1, kDataOverrun = 0xa101;

std::string guid(const Usb3CameraOptions& options) { return fmt::format("12095E1D{:04X}", options.usb_number); }

// SuperSpeed; two interfaces joined by an association: control (bulk out and in) and stream (bulk in).
UsbBytes descriptors() {
  UsbBytes body = {0x08, 0x0b, 0x00, 0x02, 0xef, 0x05, 0x00, 0x00, 0x09, 0x04, 0x00, 0x00, 0x02, 0xef, 0x05, 0x00, 0x00,
                   // Device information: GenCP 1.0, USB3 Vision 1.0, strings (GUID 4, maker 1, model 2, serial number
                   // 3), SuperSpeed.
                   0x14, 0x24, 0x01, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x00, 0x04, 0x01, 0x02, 0x00, 0x00, 0x00,
                   0x03, 0x00, 0x08, 0x07, 0x05, kAnswers, 0x02, 0x00, 0x04, 0x00, 0x06, 0x30, 0x00, 0x00, 0x00, 0x00,
                   0x07, 0x05, kCommands, 0x02, 0x00, 0x04, 0x00, 0x06, 0x30, 0x00, 0x00, 0x00, 0x00, 0x09, 0x04, 0x01,
                   0x00, 0x01, 0xef, 0x05, 0x02, 0x00, 0x07, 0x05, kFrames, 0x02, 0x00, 0x04, 0x00, 0x06, 0x30, 0x0f,
                   0x00, 0x00, 0x00};
  UsbBytes all = {0x12, 0x01, 0x00, 0x03, 0xef, 0x02, 0x01, 0x09, 0x09, 0x12,
                  0x1d, 0x5e, 0x00, 0x01, 0x01, 0x02, 0x03, 0x01, 0x09, 0x02};
  put_little(all, 9 + body.size(), 2);
  all.insert(all.end(), {0x02, 0x01, 0x00, 0x80, 0x70});
  all.insert(all.end(), body.begin(), body.end());
  return all;
}

}  // namespace

struct Usb3Camera::State {
  State(const Usb3CameraOptions& given, ImageSource image_at)
      : options(given), registers(given),
        usb({given.usb_number, 5000, descriptors(), {kMaker, kModel, given.serial, guid(given)}},
            [this](uint8_t, const UsbBytes& bytes) { on_command(bytes); }),
        sensor({given.width_px, given.height_px, given.readout_s, given.clock_offset_s, given.clock_drift_ppm},
               registers, std::move(image_at), [this](SensorFrame&& frame) { send(frame); }) {}

  void on_command(const UsbBytes& bytes);
  AccessError execute(uint16_t command, const uint8_t* data, size_t size, UsbBytes& reply);
  void act(uint64_t address);
  void send(const SensorFrame& frame);
  size_t cut(size_t frame_bytes, const std::function<void(size_t begin, size_t count)>& transfer) const;

  const Usb3CameraOptions options;
  Usb3Registers registers;
  std::atomic<int> lose_next{0}, spoil_next{0};
  std::atomic<bool> hangs{false};
  std::atomic<int64_t> lost{0}, commands{0}, refused{0};
  hardware_sim::UsbDevice usb;
  Sensor sensor;  // last: its thread uses all above
};

// ---------------------------------------------------------------- control

// prefix u32, flags u16, command u16, length u16, request id u16, then the data; the acknowledge has a status for
// flags.
void Usb3Camera::State::on_command(const UsbBytes& bytes) {
  ++commands;
  if (hangs) return;
  if (bytes.size() < kHeaderBytes || get_little(bytes.data(), 4) != kCommandMagic) {
    ++refused;
    return;
  }
  const auto flags = static_cast<uint16_t>(get_little(&bytes[4], 2)),
             command = static_cast<uint16_t>(get_little(&bytes[6], 2));
  const size_t size = get_little(&bytes[8], 2);
  UsbBytes reply;
  const AccessError error = size != bytes.size() - kHeaderBytes || bytes.size() > kLargestCommand
                                ? AccessError::invalid_header
                                : execute(command, bytes.data() + kHeaderBytes, size, reply);
  if (error != AccessError::none) {
    ++refused;
    reply.clear();
  }
  if ((flags & kAckRequired) == 0) return;
  UsbBytes answer;
  put_little(answer, kCommandMagic, 4);
  put_little(answer, error == AccessError::none ? 0 : kErrorBit | static_cast<uint16_t>(error), 2);
  put_little(answer, command + 1u, 2);
  put_little(answer, reply.size(), 2);
  put_little(answer, get_little(&bytes[10], 2), 2);
  answer.insert(answer.end(), reply.begin(), reply.end());
  usb.send(kAnswers, std::move(answer));
}

AccessError Usb3Camera::State::execute(uint16_t command, const uint8_t* data, size_t size, UsbBytes& reply) {
  switch (command) {
    case kRead: {
      if (size != 12) return AccessError::invalid_header;
      const size_t count = get_little(data + 10, 2);
      if (count == 0 || count > kLargestCommand - kHeaderBytes) return AccessError::invalid_parameter;
      reply.resize(count);
      return registers.read(get_little(data, 8), reply.data(), count);
    }
    case kWrite: {
      if (size <= 8) return AccessError::invalid_header;
      const uint64_t address = get_little(data, 8);
      const AccessError error = registers.write(address, data + 8, size - 8);
      if (error != AccessError::none) return error;
      act(address);
      put_little(reply, 0, 2);
      put_little(reply, size - 8, 2);
      return AccessError::none;
    }
    default: return AccessError::not_implemented;
  }
}

void Usb3Camera::State::act(uint64_t address) {
  switch (address) {
    case reg::kTimestampLatch:
      registers.set_long(reg::kTimestamp, static_cast<uint64_t>(sensor.ticks(rig::host_now_s())));
      break;
    case reg::kStreamControl: usb.discard(kFrames); break;  // a stream begins with an empty memory
    case reg::kAcquisitionStart: sensor.start(); break;
    case reg::kAcquisitionStop: sensor.stop(); break;
    case reg::kTriggerSoftware:
      if (registers.word(reg::kTriggerSource) == 1) sensor.trigger(rig::host_now_s());
      break;
    default: break;
  }
}

// ---------------------------------------------------------------- stream

// The payload's transfers as the host asked for them; returns the bytes that they hold.
size_t Usb3Camera::State::cut(size_t frame_bytes, const std::function<void(size_t, size_t)>& transfer) const {
  size_t begin = 0;
  const auto take = [&](size_t size) {
    const size_t count = std::min(size, frame_bytes - begin);
    if (count > 0) transfer(begin, count);
    begin += count;
  };
  const size_t size = registers.word(reg::kPayloadSize);
  for (uint32_t i = registers.word(reg::kPayloadCount); i-- > 0 && begin < frame_bytes;) take(size);
  take(registers.word(reg::kTransfer1));
  take(registers.word(reg::kTransfer2));
  return begin;
}

// On the sensor's thread.
void Usb3Camera::State::send(const SensorFrame& frame) {
  const size_t room = static_cast<size_t>(options.memory_frames) * frame.pixels.size();
  const bool injected = lose_next > 0 && lose_next-- > 0;
  if (injected || hangs || registers.word(reg::kStreamControl) == 0 ||
      usb.waiting_bytes(kFrames) + frame.pixels.size() > room) {
    ++lost;
    return;
  }
  const bool spoiled = spoil_next > 0 && spoil_next-- > 0;
  const size_t frame_bytes = spoiled ? frame.pixels.size() / 2 : frame.pixels.size();
  std::this_thread::sleep_for(
      std::chrono::duration<double>(static_cast<double>(frame_bytes) / options.link_bytes_per_s));

  // magic u32, reserved u16, size u16, block id u64 before either.
  const auto id = static_cast<uint64_t>(frame.number - 1);
  UsbBytes leader;
  put_little(leader, kLeaderMagic, 4);
  put_little(leader, kLeaderBytes << 16, 4);
  put_little(leader, id, 8);
  put_little(leader, kImage << 16, 4);  // reserved, payload type
  put_little(leader, static_cast<uint64_t>(frame.ticks), 8);
  put_little(leader, kMono8, 4);
  put_little(leader, static_cast<uint64_t>(options.width_px), 4);
  put_little(leader, static_cast<uint64_t>(options.height_px), 4);
  leader.resize(kLeaderBytes);  // offsets and padding: 0
  usb.send(kFrames, std::move(leader));
  const size_t sent = cut(frame_bytes, [&](size_t begin, size_t count) {
    const auto* pixels = frame.pixels.data() + begin;
    usb.send(kFrames, UsbBytes(pixels, pixels + count));
  });
  UsbBytes trailer;
  put_little(trailer, kTrailerMagic, 4);
  put_little(trailer, kTrailerBytes << 16, 4);
  put_little(trailer, id, 8);
  put_little(trailer, sent == frame.pixels.size() ? 0 : kDataOverrun, 4);  // status, reserved
  put_little(trailer, sent, 8);
  put_little(trailer, static_cast<uint64_t>(options.height_px), 4);
  usb.send(kFrames, std::move(trailer));
}

// ---------------------------------------------------------------- the device's face

Usb3Camera::Usb3Camera(const Usb3CameraOptions& options, ImageSource image_at)
    : state_(std::make_unique<State>(options, std::move(image_at))) {
  state_->usb.plug_in();
}
Usb3Camera::~Usb3Camera() = default;

std::string Usb3Camera::name() const {
  return fmt::format("{}-{}-{}", kMaker, guid(state_->options), state_->options.serial);
}

void Usb3Camera::trigger_edge(double host_s) {
  if (state_->registers.word(reg::kTriggerSource) == 0) state_->sensor.trigger(host_s);
}
void Usb3Camera::lose_next(int frames) { state_->lose_next = frames; }
void Usb3Camera::spoil_next(int frames) { state_->spoil_next = frames; }
void Usb3Camera::halt_stream() { state_->usb.halt(kFrames); }
void Usb3Camera::hang(bool hangs) { state_->hangs = hangs; }
// Power comes over the cable: what was running is not afterwards.
void Usb3Camera::unplug() {
  state_->usb.unplug();
  state_->sensor.stop();
  state_->registers.set_word(reg::kStreamControl, 0);
}
void Usb3Camera::replug() { state_->usb.plug_in(); }

bool Usb3Camera::streaming() const { return state_->sensor.running(); }
Usb3CameraCounts Usb3Camera::counts() const {
  return {state_->sensor.frames(), state_->sensor.missed_exposures(), state_->lost, state_->commands, state_->refused};
}
int64_t Usb3Camera::device_ticks(double host_s) const { return state_->sensor.ticks(host_s); }

}  // namespace selvedge::sim
