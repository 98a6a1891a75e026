// RTDE packages of a Universal Robots controller: u16 size with header, u8 type, payload; big-endian, packed.
//
// Source: Universal Robots' RTDE manual page and Client Library (Apache-2.0), protocol version 2.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rig/wire/bytes.h"

namespace selvedge::arm::rtde {

inline constexpr char negotiate = 'V', version = 'v', setup_outputs = 'O', start = 'S', data = 'U', message = 'M';

struct Package {
  char type = 0;
  std::vector<std::uint8_t> payload;
};

std::vector<std::uint8_t> encode(char type, const wire::BigWriter& payload);

// Takes the first whole package off the front of `received`; none where it is not there yet.
// Throws WireError where its size is impossible.
std::optional<Package> take_package(std::vector<std::uint8_t>& received);

// The outputs that the daemon asks for, in this order.
inline constexpr const char* output_names = "timestamp,actual_q,actual_qd,robot_mode,safety_mode";
inline constexpr const char* output_types = "DOUBLE,VECTOR6D,VECTOR6D,INT32,INT32";

struct State {
  double timestamp_s = 0;  // controller's clock, since it was switched on
  double q_rad[6]{}, qd_rad_s[6]{};
  std::int32_t robot_mode = 0;   // 7 running
  std::int32_t safety_mode = 0;  // 1 normal
};
// Payload of a data package of recipe `recipe`. Throws WireError where it is another recipe, another length, or
// not finite.
State decode_state(std::span<const std::uint8_t> payload, std::uint8_t recipe);

// What the script on the robot reads each cycle: eight i32, big-endian: time-out ms, 6 joint angles in 1e-6 rad, mode.
std::vector<std::uint8_t> encode_set_point(const double* q_rad, bool move, double timeout_s);

}  // namespace selvedge::arm::rtde
