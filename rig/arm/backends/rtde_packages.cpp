#include "rig/arm/backends/rtde_packages.h"

#include <cmath>

namespace selvedge::arm::rtde {

namespace {
constexpr size_t kHeader = 3;
constexpr std::int32_t kIdle = 0, kServoJ = 1;
}  // namespace

std::vector<std::uint8_t> encode(char type, const wire::BigWriter& payload) {
  wire::BigWriter package;
  package.number<std::uint16_t>(static_cast<std::uint16_t>(kHeader + payload.size()));
  package.number<std::uint8_t>(static_cast<std::uint8_t>(type)).raw(payload.bytes());
  return package.bytes();
}

std::optional<Package> take_package(std::vector<std::uint8_t>& received) {
  if (received.size() < kHeader) return std::nullopt;
  wire::BigReader reader(received);
  const size_t size = reader.number<std::uint16_t>();
  if (size < kHeader) throw wire::WireError(fmt::format("an RTDE package of {} bytes", size));
  if (received.size() < size) return std::nullopt;
  Package package;
  package.type = static_cast<char>(reader.number<std::uint8_t>());
  package.payload.assign(received.begin() + kHeader, received.begin() + static_cast<long>(size));
  received.erase(received.begin(), received.begin() + static_cast<long>(size));
  return package;
}

State decode_state(std::span<const std::uint8_t> payload, std::uint8_t recipe) {
  wire::BigReader reader(payload);
  if (const auto got = reader.number<std::uint8_t>(); got != recipe)
    throw wire::WireError(fmt::format("RTDE data of recipe {}, expected {}", got, recipe));
  State state;
  bool finite = true;
  const auto value = [&] {
    const double number = reader.number<double>();
    finite = finite && std::isfinite(number);
    return number;
  };
  state.timestamp_s = value();
  for (double& angle : state.q_rad) angle = value();
  for (double& speed : state.qd_rad_s) speed = value();
  state.robot_mode = reader.number<std::int32_t>();
  state.safety_mode = reader.number<std::int32_t>();
  if (reader.left() != 0) throw wire::WireError(fmt::format("RTDE data with {} bytes too many", reader.left()));
  if (!finite || state.timestamp_s < 0 || state.timestamp_s > 1e9)
    throw wire::WireError("RTDE data with numbers that no robot measures");
  return state;
}

std::vector<std::uint8_t> encode_set_point(const double* q_rad, bool move, double timeout_s) {
  wire::BigWriter packet;
  packet.number<std::int32_t>(static_cast<std::int32_t>(std::lround(timeout_s * 1e3)));
  for (int joint = 0; joint < 6; ++joint)
    packet.number<std::int32_t>(move ? static_cast<std::int32_t>(std::lround(q_rad[joint] * 1e6)) : 0);
  packet.number<std::int32_t>(move ? kServoJ : kIdle);
  return packet.bytes();
}

}  // namespace selvedge::arm::rtde
