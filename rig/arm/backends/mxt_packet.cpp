#include "rig/arm/backends/mxt_packet.h"

#include <cmath>

#include "rig/wire/bytes.h"

namespace selvedge::arm::mxt {

namespace {

constexpr std::uint16_t kNothing = 0, kCommandJoint = 2, kFilteredJoint = 5, kEncoderJoint = 8, kCurrent = 11;
constexpr size_t kDataBytes = 40;

void pad(wire::LittleWriter& packet, size_t size) {
  while (packet.size() < size) packet.number<std::uint8_t>(0);
}

Eigen::VectorXd read_joints(wire::LittleReader data, int joints) {
  Eigen::VectorXd q(joints);
  for (int joint = 0; joint < joints; ++joint) {
    q[joint] = static_cast<double>(data.number<float>());
    if (!std::isfinite(q[joint]) || std::abs(q[joint]) > 1e4)
      throw wire::WireError(fmt::format("mxt: joint {} at {}", joint + 1, q[joint]));
  }
  return q;
}

}  // namespace

std::vector<std::uint8_t> encode(const Request& request) {
  wire::LittleWriter packet;
  packet.number<std::uint16_t>(request.command);
  packet.number<std::uint16_t>(request.command == move ? kCommandJoint : kNothing);
  packet.number<std::uint16_t>(kCommandJoint);
  pad(packet, 8);
  for (const float angle : request.joint_rad) packet.number<float>(angle);
  pad(packet, 60);
  packet.number<std::uint32_t>(request.count);
  packet.number<std::uint16_t>(kFilteredJoint);
  pad(packet, 108);
  packet.number<std::uint16_t>(kEncoderJoint);
  pad(packet, 152);
  packet.number<std::uint16_t>(kCurrent);
  pad(packet, packet_bytes);
  return packet.bytes();
}

Reply decode(std::span<const std::uint8_t> bytes, int joints) {
  if (bytes.size() != packet_bytes)
    throw wire::WireError(fmt::format("mxt: a packet of {} bytes, expected {}", bytes.size(), packet_bytes));
  wire::LittleReader packet(bytes);
  packet.take(4);
  const auto type = packet.number<std::uint16_t>();
  packet.take(2);
  auto command = packet.part(kDataBytes);
  packet.take(12);
  Reply reply;
  reply.count = packet.number<std::uint32_t>();
  const auto type1 = packet.number<std::uint16_t>();
  packet.take(2);
  auto filtered = packet.part(kDataBytes);
  const auto type2 = packet.number<std::uint16_t>();
  packet.take(2);
  auto encoder = packet.part(kDataBytes);
  if (type != kCommandJoint || type1 != kFilteredJoint || type2 != kEncoderJoint)
    throw wire::WireError(fmt::format("mxt: data of types {}, {}, {}, expected {}, {}, {}", type, type1, type2,
                                      kCommandJoint, kFilteredJoint, kEncoderJoint));
  reply.command_rad = read_joints(command, joints);
  reply.filtered_rad = read_joints(filtered, joints);
  reply.encoder_rad = read_joints(encoder, joints);
  return reply;
}

}  // namespace selvedge::arm::mxt
