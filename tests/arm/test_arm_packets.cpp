#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "rig/arm/backends/mxt_packet.h"
#include "rig/arm/backends/rtde_packages.h"

namespace selvedge::arm {
namespace {

std::vector<std::uint8_t> rtde_data() {
  wire::BigWriter payload;
  payload.number<std::uint8_t>(1).number<double>(12.5);
  for (int i = 0; i < 12; ++i) payload.number<double>(0.1 * i);
  payload.number<std::int32_t>(7).number<std::int32_t>(1);
  return payload.bytes();
}

TEST(RtdePackages, StateIsReadInRecipeOrder) {
  const auto state = rtde::decode_state(rtde_data(), 1);
  EXPECT_EQ(state.timestamp_s, 12.5);
  EXPECT_DOUBLE_EQ(state.q_rad[5], 0.5);
  EXPECT_DOUBLE_EQ(state.qd_rad_s[0], 0.6);
  EXPECT_EQ(state.robot_mode, 7);
  EXPECT_EQ(state.safety_mode, 1);
  EXPECT_THROW(rtde::decode_state(rtde_data(), 2), wire::WireError);
}

TEST(RtdePackages, SetPointIsEightBigEndianIntegers) {
  const double q[6] = {1, -0.5, 0, 0, 0, 0.25};
  const auto bytes = rtde::encode_set_point(q, true, 0.1);
  const std::vector<std::uint8_t> expected{0, 0, 0, 100, 0x00, 0x0F, 0x42, 0x40, 0xFF, 0xF8, 0x5E, 0xE0, 0, 0, 0, 0,
                                           0, 0, 0, 0,   0,    0,    0,    0,    0x00, 0x03, 0xD0, 0x90, 0, 0, 0, 1};
  EXPECT_EQ(bytes, expected);
  EXPECT_EQ(rtde::encode_set_point(nullptr, false, 0.1).back(), 0);
}

TEST(RtdePackages, SeveralPackagesInOneSegmentAndHalvesOfOne) {
  const auto package = rtde::encode('U', wire::BigWriter().raw(rtde_data()));
  std::vector<std::uint8_t> received;
  for (int i = 0; i < 3; ++i) received.insert(received.end(), package.begin(), package.end());
  received.resize(received.size() - 5);
  EXPECT_TRUE(rtde::take_package(received));
  EXPECT_TRUE(rtde::take_package(received));
  EXPECT_FALSE(rtde::take_package(received));
  received.insert(received.end(), package.end() - 5, package.end());
  EXPECT_EQ(rtde::take_package(received)->payload, rtde_data());
}

TEST(RtdePackages, SurviveDamagedAndRandomBytes) {
  std::mt19937 random(3);
  int read = 0, refused = 0;
  for (int round = 0; round < 200000; ++round) {
    auto bytes = rtde::encode('U', wire::BigWriter().raw(rtde_data()));
    for (unsigned i = 0; i <= random() % 4; ++i) bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    bytes.resize(round % 3 == 0 ? random() % bytes.size() : bytes.size());
    try {
      while (const auto package = rtde::take_package(bytes)) {
        const auto state = rtde::decode_state(package->payload, 1);
        for (const double angle : state.q_rad) ASSERT_TRUE(std::isfinite(angle));
        ++read;
      }
    } catch (const wire::WireError&) { ++refused; }
  }
  EXPECT_GT(read, 1000);
  EXPECT_GT(refused, 1000);
}

TEST(MxtPacket, HasTheControllersOffsets) {
  mxt::Request request;
  request.command = mxt::move;
  request.joint_rad[0] = 1;
  request.joint_rad[6] = -2;
  request.count = 0x01020304;
  const auto bytes = mxt::encode(request);
  ASSERT_EQ(bytes.size(), 196u);
  const auto u16 = [&](size_t at) { return bytes[at] | bytes[at + 1] << 8; };
  EXPECT_EQ(u16(0), 1);
  EXPECT_EQ(u16(2), 2);
  EXPECT_EQ(u16(4), 2);
  EXPECT_EQ(u16(64), 5);
  EXPECT_EQ(u16(108), 8);
  EXPECT_EQ(u16(152), 11);
  EXPECT_EQ(bytes[60], 4);
  EXPECT_EQ(bytes[63], 1);
  EXPECT_EQ(bytes[11], 0x3F);          // 1.0f begins at byte 8
  EXPECT_EQ(bytes[8 + 24 + 3], 0xC0);  // −2.0f is the seventh
}

TEST(MxtPacket, SurvivesDamagedAndRandomBytes) {
  std::mt19937 random(4);
  int read = 0, refused = 0;
  for (int round = 0; round < 200000; ++round) {
    auto bytes = mxt::encode({.command = mxt::move});
    for (unsigned i = 0; i <= random() % 6; ++i) bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    if (round % 5 == 0) bytes.resize(random() % 400);
    try {
      const auto reply = mxt::decode(bytes, 7);
      ASSERT_TRUE(reply.encoder_rad.allFinite() && reply.command_rad.allFinite());
      ++read;
    } catch (const wire::WireError&) { ++refused; }
  }
  EXPECT_GT(read, 1000);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace selvedge::arm
