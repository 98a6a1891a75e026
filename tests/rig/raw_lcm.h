// LCM without our bus: what any program on the host may send.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <lcm/lcm.h>

#include "rig/clock.h"
#include "selvedge_rig/corner_sample_t.hpp"

namespace selvedge::rig {

inline constexpr const char* kChannel = "TRACKER_CORNERS";

inline std::string multicast_url(int port, int ttl = 0) {
  return fmt::format("udpm://239.255.76.67:{}?ttl={}", port, ttl);
}

class RawLcm {
 public:
  explicit RawLcm(const std::string& url) : lcm_(lcm_create(url.c_str())) {
    if (lcm_ == nullptr) throw std::runtime_error("LCM cannot open " + url);
  }
  ~RawLcm() { lcm_destroy(lcm_); }
  RawLcm(const RawLcm&) = delete;
  RawLcm& operator=(const RawLcm&) = delete;
  void send(const std::string& channel, const std::vector<uint8_t>& bytes) {
    lcm_publish(lcm_, channel.c_str(), bytes.data(), static_cast<unsigned>(bytes.size()));
  }

 private:
  lcm_t* lcm_;
};

template <class Message>
std::vector<uint8_t> encoded(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

// One marker; the frame's number tells senders apart.
inline selvedge_rig::corner_sample_t one_corner(int64_t sequence, int64_t frame_number) {
  selvedge_rig::corner_sample_t sample{};
  sample.utime = host_now_us();
  sample.sequence = sequence;
  sample.frame_number = frame_number;
  sample.count = 1;
  sample.name = {"left"};
  sample.x_m = sample.y_m = sample.z_m = {0.5};
  sample.occluded = {0};
  return sample;
}

}  // namespace selvedge::rig
