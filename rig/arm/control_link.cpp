#include "rig/arm/control_link.h"

#include <array>

#include <fmt/format.h>

#include "rig/arm/daemon.h"
#include "rig/clock.h"
#include "rig/runtime_folder.h"
#include "rig/wire/bytes.h"

namespace selvedge::arm {

using selvedge_rig::arm_answer_t;
using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;
using selvedge_rig::arm_trajectory_t;

namespace {
constexpr size_t kHeader = 4;
constexpr double kAnswer_s = 3;
}  // namespace

std::vector<std::uint8_t> encode_frame(FrameKind kind, const std::vector<std::uint8_t>& payload) {
  wire::BigWriter frame;
  frame.number<std::uint32_t>(static_cast<std::uint32_t>(payload.size() + 1));
  frame.number<std::uint8_t>(static_cast<std::uint8_t>(kind)).raw(payload);
  return frame.bytes();
}

std::optional<Frame> take_frame(std::vector<std::uint8_t>& received) {
  if (received.size() < kHeader + 1) return std::nullopt;
  wire::BigReader reader(received);
  const size_t size = reader.number<std::uint32_t>();
  if (size < 1 || size > largest_frame_bytes)
    throw wire::WireError(fmt::format("a frame of {} bytes, expected 1 to {}", size, largest_frame_bytes));
  const auto kind = reader.number<std::uint8_t>();
  if (kind < 1 || kind > 4) throw wire::WireError(fmt::format("a frame of kind {}, expected 1 to 4", kind));
  if (received.size() < kHeader + size) return std::nullopt;
  const auto end = received.begin() + static_cast<long>(kHeader + size);
  Frame frame{static_cast<FrameKind>(kind), {received.begin() + kHeader + 1, end}};
  received.erase(received.begin(), end);
  return frame;
}

std::filesystem::path control_socket(const rig::Configuration& configuration, const std::string& device) {
  const ArmConfiguration own = read_configuration(configuration.section(device));
  if (!own.control_socket.empty()) return own.control_socket;
  return rig::runtime_folder() / fmt::format("{}-{}.socket", device, configuration.bus().port);
}

std::filesystem::path stop_file(const rig::Configuration& configuration, const std::string& device) {
  const ArmConfiguration own = read_configuration(configuration.section(device));
  if (!own.stop_file.empty()) return own.stop_file;
  if (!own.control_socket.empty()) return own.control_socket.string() + ".stopped";
  return rig::state_folder() / fmt::format("{}-{}.stopped", device, configuration.bus().port);
}

ControlClient::ControlClient(const std::filesystem::path& socket) {
  try {
    socket_ = wire::connect_unix(socket);
  } catch (const wire::Disconnected& error) {
    throw wire::Disconnected(fmt::format("arm: its daemon does not listen: {}", error.what()));
  }
}

void ControlClient::await_answer(int64_t sequence, const char* what) {
  const double end_s = rig::host_now_s() + kAnswer_s;
  while (socket_.readable(std::max(0.0, end_s - rig::host_now_s()))) {
    std::array<std::uint8_t, 4096> part;
    const size_t got = socket_.receive(part);
    received_.insert(received_.end(), part.begin(), part.begin() + static_cast<long>(got));
    while (const auto frame = take_frame(received_)) {
      const auto answer = decode_payload<arm_answer_t>(frame->payload);
      if (!answer || answer->sequence != sequence) continue;
      if (!answer->done) throw ControlRefused("arm: " + answer->text);
      return;
    }
  }
  throw wire::Disconnected(fmt::format("arm: its daemon does not answer to {} within {} s", what, kAnswer_s));
}

void ControlClient::control(int8_t action, const std::string& reason, int64_t stop_number) {
  static constexpr std::array<const char*, 4> kNames = {"stop", "arm", "disarm", "reset"};
  const std::lock_guard asking(asking_);
  arm_control_t message{};
  message.sequence = ++asked_;
  message.utime = rig::host_now_us();
  message.action = action;
  message.stop_number = stop_number;
  message.reason = reason;
  {
    const std::lock_guard lock(sending_);
    socket_.send(encode_frame(FrameKind::control, message));
  }
  await_answer(message.sequence, kNames.at(static_cast<size_t>(action)));
}

void ControlClient::stop(const std::string& reason) { control(arm_control_t::STOP, reason); }
void ControlClient::reset(int64_t stop_number, const std::string& whose) {
  control(arm_control_t::RESET, whose, stop_number);
}
void ControlClient::arm(const std::string& whose_word) { control(arm_control_t::ARM, whose_word); }
void ControlClient::disarm(const std::string& reason) { control(arm_control_t::DISARM, reason); }

int64_t ControlClient::send(arm_trajectory_t trajectory) {
  const std::lock_guard asking(asking_);
  trajectory.sequence = ++asked_;
  trajectory.utime = rig::host_now_us();
  {
    const std::lock_guard lock(sending_);
    socket_.send(encode_frame(FrameKind::trajectory, trajectory));
  }
  await_answer(trajectory.sequence, "a path");
  return trajectory.utime;
}

void ControlClient::command(arm_command_t command) {
  const std::lock_guard lock(sending_);
  command.sequence = ++commanded_;
  command.utime = rig::host_now_us();
  socket_.send(encode_frame(FrameKind::command, command));
}

void stop_arm(const rig::Configuration& configuration, const std::string& reason, const std::string& device) {
  ControlClient(control_socket(configuration, device)).stop(reason);
}

}  // namespace selvedge::arm
