// The 196-byte packet of MELFA real-time external control, little-endian, natural C alignment.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace selvedge::arm::mxt {

inline constexpr size_t packet_bytes = 196;
inline constexpr std::uint16_t watch = 0, move = 1, end = 255;  // commands

struct Request {
  std::uint16_t command = watch;
  std::array<float, 8> joint_rad{};  // absolute; 7th and 8th of a linear axis are mm
  std::uint32_t count = 0;           // comes back in the reply
};
// Asks for the command joints (type 2) in dat, filtered joints (5) in dat1, encoders (8) in dat2, current (11) in dat3.
std::vector<std::uint8_t> encode(const Request& request);

struct Reply {
  std::uint32_t count = 0;
  Eigen::VectorXd command_rad, filtered_rad, encoder_rad;
};
// Throws wire::WireError where the packet has another length, does not hold joints, or holds what no joint measures.
Reply decode(std::span<const std::uint8_t> packet, int joints);

}  // namespace selvedge::arm::mxt
