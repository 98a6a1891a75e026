#include "hardware_sim/gige_camera/stream.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>

#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "hardware_sim/genicam_camera/features.h"
#include "hardware_sim/gige_camera/big_endian.h"

namespace selvedge::sim {

namespace {

constexpr size_t kPacketHeaderBytes = 36;  // IP 20, UDP 8, GVSP 8
constexpr size_t kFramesRemembered = 16;
constexpr int kPacketsPerBurst = 8;  // sleeping after each packet would cost more than the packet
constexpr uint8_t kLeader = 1, kTrailer = 2, kPayload = 3;
constexpr uint16_t kPacketUnavailable = 0x800c;
constexpr uint16_t kImage = 1;

std::vector<uint8_t> leader(const StreamFrame& frame) {
  std::vector<uint8_t> bytes;
  put16(bytes, 0);
  put16(bytes, kImage);
  put32(bytes, static_cast<uint32_t>(static_cast<uint64_t>(frame.ticks) >> 32));
  put32(bytes, static_cast<uint32_t>(frame.ticks));
  put32(bytes, kMono8);
  put32(bytes, static_cast<uint32_t>(frame.width_px));
  put32(bytes, static_cast<uint32_t>(frame.height_px));
  put32(bytes, 0);  // offset x, y, then both paddings
  put32(bytes, 0);
  put32(bytes, 0);
  return bytes;
}

std::vector<uint8_t> trailer(const StreamFrame& frame) {
  std::vector<uint8_t> bytes;
  put32(bytes, kImage);
  put32(bytes, static_cast<uint32_t>(frame.height_px));
  return bytes;
}

}  // namespace

Stream::Stream(const std::string& address, double link_bits_per_s, unsigned seed)
    : link_bits_per_s_(link_bits_per_s), random_(seed) {
  socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in local{};
  local.sin_family = AF_INET;
  ::inet_pton(AF_INET, address.c_str(), &local.sin_addr);
  socklen_t size = sizeof local;
  if (::bind(socket_, reinterpret_cast<sockaddr*>(&local), size) != 0) {
    ::close(socket_);
    refuse("simulated camera", "cannot bind a stream socket on {}: {}", address, std::strerror(errno));
  }
  ::getsockname(socket_, reinterpret_cast<sockaddr*>(&local), &size);
  port_ = ntohs(local.sin_port);
}

Stream::~Stream() { ::close(socket_); }

void Stream::set_destination(uint32_t ip_address, uint16_t port, uint32_t packet_size) {
  const std::lock_guard lock(mutex_);
  destination_.sin_family = AF_INET;
  destination_.sin_addr.s_addr = htonl(ip_address);
  destination_.sin_port = htons(port);
  packet_size_ = packet_size;
}

void Stream::set_faults(const GigeCameraFaults& faults) {
  const std::lock_guard lock(mutex_);
  faults_ = faults;
}

void Stream::count(GigeCameraCounts& counts) const {
  const std::lock_guard lock(mutex_);
  counts.packets = counts_.packets;
  counts.packets_lost = counts_.packets_lost;
  counts.packets_resent = counts_.packets_resent;
  counts.resends_refused = counts_.resends_refused;
}

Stream::Cut Stream::cut(const StreamFrame& frame, uint32_t packet_size) const {
  const size_t data = packet_size - kPacketHeaderBytes;
  return {data, static_cast<uint32_t>((frame.pixels.size() + data - 1) / data) + 1};
}

void Stream::send(std::shared_ptr<const StreamFrame> frame) {
  Cut pieces;
  double stall_s = 0;
  {
    const std::lock_guard lock(mutex_);
    pieces = cut(*frame, packet_size_);
    sent_.push_back(frame);
    if (sent_.size() > kFramesRemembered) sent_.pop_front();
    if (std::uniform_real_distribution<>()(random_) < faults_.stall_probability) stall_s = faults_.stall_s;
  }
  if (stall_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(stall_s));

  auto due = std::chrono::steady_clock::now();
  const std::chrono::duration<double> packet_time(static_cast<double>(pieces.data_per_packet + kPacketHeaderBytes) * 8 /
                                                  link_bits_per_s_);
  for (uint32_t id = 0; id <= pieces.trailer_id; ++id) {
    {
      const std::lock_guard lock(mutex_);
      ++counts_.packets;
      send_packet(*frame, pieces, id);
    }
    due += std::chrono::duration_cast<std::chrono::steady_clock::duration>(packet_time);
    if (id % kPacketsPerBurst != kPacketsPerBurst - 1) continue;
    std::this_thread::sleep_until(due);
    due = std::max(due, std::chrono::steady_clock::now());  // a link never makes up for lost time
  }
}

void Stream::resend(uint16_t block_id, uint32_t first_packet, uint32_t last_packet) {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(sent_.begin(), sent_.end(), [&](const auto& frame) { return frame->block_id == block_id; });
  if (found == sent_.end()) {
    ++counts_.resends_refused;
    send_bytes(kPacketUnavailable, block_id, kPayload, first_packet, nullptr, 0);
    return;
  }
  const Cut pieces = cut(**found, packet_size_);
  for (uint32_t id = first_packet; id <= std::min(last_packet, pieces.trailer_id); ++id) {
    ++counts_.packets_resent;
    send_packet(**found, pieces, id);
  }
}

void Stream::send_test_packet(uint32_t packet_size) {
  const std::lock_guard lock(mutex_);
  const std::vector<uint8_t> filling(packet_size - kPacketHeaderBytes, 0x55);
  send_bytes(0, 0, kPayload, 0, filling.data(), filling.size());
}

void Stream::send_packet(const StreamFrame& frame, const Cut& pieces, uint32_t packet_id) {
  if (packet_id == 0) {
    const auto bytes = leader(frame);
    send_bytes(0, frame.block_id, kLeader, packet_id, bytes.data(), bytes.size());
  } else if (packet_id == pieces.trailer_id) {
    const auto bytes = trailer(frame);
    send_bytes(0, frame.block_id, kTrailer, packet_id, bytes.data(), bytes.size());
  } else {
    const size_t begin = (packet_id - 1) * pieces.data_per_packet;
    const size_t size = std::min(pieces.data_per_packet, frame.pixels.size() - begin);
    send_bytes(0, frame.block_id, kPayload, packet_id, frame.pixels.data() + begin, size);
  }
}

void Stream::send_bytes(uint16_t status, uint16_t block_id, uint8_t content, uint32_t packet_id, const uint8_t* data,
                        size_t size) {
  if (faults_.unplugged) return;
  if (std::uniform_real_distribution<>()(random_) < faults_.stream_loss) {
    ++counts_.packets_lost;
    return;
  }
  std::vector<uint8_t> header;
  put16(header, status);
  put16(header, block_id);
  put32(header, uint32_t{content} << 24 | (packet_id & 0xffffff));
  iovec parts[2] = {{header.data(), header.size()}, {const_cast<uint8_t*>(data), size}};
  msghdr message{};
  message.msg_name = &destination_;
  message.msg_namelen = sizeof destination_;
  message.msg_iov = parts;
  message.msg_iovlen = size > 0 ? 2 : 1;
  ::sendmsg(socket_, &message, 0);  // a client that has gone is no fault of the camera
}

}  // namespace selvedge::sim
