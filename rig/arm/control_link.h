// Control of the arm: a Unix socket between its daemon and whoever commands it, off the open bus.
//
// A frame is u32 size of what follows (big-endian), u8 kind, one message of rig/messages. The kernel tells the daemon
// which user sits at the other end (control_server.h). A connection that ends lets go of the arm. A stop is answered
// once it is latched and on the disk; all else once the control loop has obeyed or refused it. Commands (the lease) are
// not answered. The socket serves one host: over `ssh -L` its peer is the user whom sshd runs as.
#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <selvedge_rig/arm_answer_t.hpp>
#include <selvedge_rig/arm_command_t.hpp>
#include <selvedge_rig/arm_control_t.hpp>
#include <selvedge_rig/arm_trajectory_t.hpp>

#include "rig/configuration.h"
#include "rig/wire/socket.h"

namespace selvedge::arm {

enum class FrameKind : std::uint8_t { control = 1, command = 2, trajectory = 3, answer = 4 };
inline constexpr size_t largest_frame_bytes = size_t{4} << 20;

struct Frame {
  FrameKind kind = FrameKind::control;
  std::vector<std::uint8_t> payload;
};

std::vector<std::uint8_t> encode_frame(FrameKind kind, const std::vector<std::uint8_t>& payload);
// Takes the first whole frame off the front of `received`; none where it is not there yet. Throws wire::WireError where
// its size or kind is impossible.
std::optional<Frame> take_frame(std::vector<std::uint8_t>& received);

template <class Message>
std::vector<std::uint8_t> encode_frame(FrameKind kind, const Message& message) {
  std::vector<std::uint8_t> payload(static_cast<size_t>(message.getEncodedSize()));
  message.encode(payload.data(), 0, static_cast<int>(payload.size()));
  return encode_frame(kind, payload);
}
// None where the payload is not exactly such a message.
template <class Message>
std::optional<Message> decode_payload(const std::vector<std::uint8_t>& payload) {
  Message message;
  try {
    const int size = static_cast<int>(payload.size());
    if (message.decode(payload.data(), 0, size) != size) return std::nullopt;
  } catch (const std::length_error&) { return std::nullopt; }
  return message;
}

// Where the daemon of `device` listens: [arm] control_socket, or arm-PORT.socket in the user's runtime folder.
std::filesystem::path control_socket(const rig::Configuration& configuration, const std::string& device = "arm");

// Where it keeps a stop that holds: [arm] stop_file; or control_socket with ".stopped" behind it, where that is given;
// or arm-PORT.stopped in the user's state folder, which outlives a login and a loss of power as the runtime folder does
// not.
std::filesystem::path stop_file(const rig::Configuration& configuration, const std::string& device = "arm");

// The daemon understood and would not; the text is the daemon's.
class ControlRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// One connection. Calls from any thread.
class ControlClient {
 public:
  // Throws wire::Disconnected where no daemon listens there.
  explicit ControlClient(const std::filesystem::path& socket);

  // Each waits for the answer. Throw ControlRefused, and wire::Disconnected where none comes.
  void stop(const std::string& reason);
  void reset(int64_t stop_number, const std::string& whose_word);
  void arm(const std::string& whose_word);
  void disarm(const std::string& reason);
  // Its sequence and utime are set here; utime is returned.
  int64_t send(selvedge_rig::arm_trajectory_t trajectory);
  // Holds the lease; not answered. Its sequence and utime are set here.
  void command(selvedge_rig::arm_command_t command);

 private:
  void control(int8_t action, const std::string& reason, int64_t stop_number = 0);
  void await_answer(int64_t sequence, const char* what);

  wire::Socket socket_;
  std::mutex sending_, asking_;
  std::vector<std::uint8_t> received_;
  int64_t asked_ = 0, commanded_ = 0;
};

// A connection for this stop alone. Throws as ControlClient does.
void stop_arm(const rig::Configuration& configuration, const std::string& reason, const std::string& device = "arm");

}  // namespace selvedge::arm
