#include "rig/projector/backends/dlpc350_commands.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "rig/clock.h"
#include "rig/projector/projector.h"
#include "rig/wire/socket.h"

namespace selvedge::projector::dlpc350 {

namespace {
constexpr std::uint8_t kWrite = 0x40, kRead = 0xC0, kRejected = 0x20;
constexpr size_t kHeader = 4, kLongestMessage = 512;
}  // namespace

void Link::send(std::uint8_t flags, const Command& command, const std::vector<std::uint8_t>& data) {
  const size_t length = 2 + data.size();
  if (kHeader + length > kLongestMessage)
    throw std::invalid_argument(
        fmt::format("{}: {} bytes, at most {}", command.name, data.size(), kLongestMessage - kHeader - 2));
  std::vector<std::uint8_t> message{flags,
                                    ++sequence_,
                                    static_cast<std::uint8_t>(length & 0xFF),
                                    static_cast<std::uint8_t>(length >> 8),
                                    static_cast<std::uint8_t>(command.code & 0xFF),
                                    static_cast<std::uint8_t>(command.code >> 8)};
  message.insert(message.end(), data.begin(), data.end());
  for (size_t at = 0; at < message.size(); at += report_bytes) {
    Report report{};
    std::copy_n(message.begin() + static_cast<long>(at), std::min(report_bytes, message.size() - at), report.begin());
    transport_->write(report);
  }
}

std::vector<std::uint8_t> Link::reply(const Command& command) {
  const double end_s = rig::host_now_s() + reply_timeout_s_;
  for (;;) {
    const auto first = transport_->read(std::max(0.0, end_s - rig::host_now_s()));
    if (!first)
      throw wire::Disconnected(fmt::format("dlpc350: no answer to {} within {} s", command.name, reply_timeout_s_));
    // An answer to an earlier command that came after we had given it up. A device that says nothing else is not
    // listened to for longer than one that is silent.
    if ((*first)[1] != sequence_ && rig::host_now_s() > end_s)
      throw wire::Disconnected(
          fmt::format("dlpc350: other answers than that to {} for {} s", command.name, reply_timeout_s_));
    if ((*first)[1] != sequence_) continue;
    if (((*first)[0] & kRejected) != 0) throw ProjectorFault(fmt::format("dlpc350: {} rejected", command.name));
    const size_t length = (*first)[2] | static_cast<size_t>((*first)[3]) << 8;
    if (length > kLongestMessage)
      throw wire::Disconnected(fmt::format("dlpc350: an answer of {} bytes to {}", length, command.name));
    std::vector<std::uint8_t> payload(first->begin() + kHeader, first->end());
    while (payload.size() < length) {
      const auto more = transport_->read(std::max(0.0, end_s - rig::host_now_s()));
      if (!more) throw wire::Disconnected(fmt::format("dlpc350: the answer to {} ends early", command.name));
      payload.insert(payload.end(), more->begin(), more->end());
    }
    payload.resize(length);
    return payload;
  }
}

void Link::write(const Command& command, const std::vector<std::uint8_t>& data) {
  send(kWrite, command, data);
  reply(command);
}

std::vector<std::uint8_t> Link::read(const Command& command, size_t least_bytes) {
  send(kRead, command, {});
  auto payload = reply(command);
  if (payload.size() < least_bytes)
    throw ProjectorFault(
        fmt::format("dlpc350: {} answered with {} bytes, {} expected", command.name, payload.size(), least_bytes));
  return payload;
}

}  // namespace selvedge::projector::dlpc350
