// GVSP: cuts frames into packets, sends them paced at the link's rate, remembers the last frames for resends.
//
// Packet: status u16, block id u16, content u8 (1 leader, 2 trailer, 3 payload), packet id u24, then the data.
// A packet of SCPS bytes counts IP, UDP and GVSP headers (36) and the data.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <vector>

#include <netinet/in.h>

#include "hardware_sim/gige_camera/gige_camera.h"

namespace selvedge::sim {

struct StreamFrame {
  uint16_t block_id = 0;
  int64_t ticks = 0;
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> pixels;
};

class Stream {
 public:
  // Throws BadInput where the address cannot be bound.
  Stream(const std::string& address, double link_bits_per_s, unsigned seed);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  void set_destination(uint32_t ip_address, uint16_t port, uint32_t packet_size);
  void set_faults(const GigeCameraFaults& faults);

  // Returns when the last packet is on the wire.
  void send(std::shared_ptr<const StreamFrame> frame);
  void resend(uint16_t block_id, uint32_t first_packet, uint32_t last_packet);
  void send_test_packet(uint32_t packet_size);

  uint16_t port() const { return port_; }
  // Adds the stream's counts to `counts`.
  void count(GigeCameraCounts& counts) const;

 private:
  struct Cut {
    size_t data_per_packet;
    uint32_t trailer_id;
  };
  Cut cut(const StreamFrame& frame, uint32_t packet_size) const;
  void send_packet(const StreamFrame& frame, const Cut& cut, uint32_t packet_id);
  void send_bytes(uint16_t status, uint16_t block_id, uint8_t content, uint32_t packet_id, const uint8_t* data,
                  size_t size);

  int socket_ = -1;
  uint16_t port_ = 0;
  double link_bits_per_s_;
  mutable std::mutex mutex_;  // guards all below
  sockaddr_in destination_{};
  uint32_t packet_size_ = 1500;
  std::deque<std::shared_ptr<const StreamFrame>> sent_;
  GigeCameraFaults faults_;
  std::mt19937 random_;
  GigeCameraCounts counts_;
};

}  // namespace selvedge::sim
