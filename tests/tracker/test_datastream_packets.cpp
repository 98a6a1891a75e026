#include <gtest/gtest.h>

#include <random>

#include "hardware_sim/datastream_server/frame_packet.h"
#include "rig/tracker/backends/datastream_packets.h"

namespace selvedge {
namespace {

using tracker::datastream::Decoder;
namespace datastream_server = hardware_sim::datastream;

std::span<const std::uint8_t> body_of(const std::vector<std::uint8_t>& packet) {
  return std::span(packet).subspan(tracker::datastream::header_bytes);
}

datastream_server::Frame two_corners() {
  datastream_server::Frame frame;
  frame.number = 7;
  frame.latency_s = 0.005;
  frame.rate_hz = 120;
  frame.seen = {{"fabric", "left", {0.1, -0.2, 1.5}}, {"fabric", "right", {0.4, -0.2, 1.5}}, {"", "", {1, 2, 3}}};
  return frame;
}

TEST(DatastreamPackets, GiveNamesPositionsRateAndLatency) {
  datastream_server::Declared declared;
  Decoder decoder;
  const auto packet = datastream_server::frame_packet(two_corners(), declared, true);
  EXPECT_EQ(tracker::datastream::packet_length(std::span(packet).first(8)), packet.size() - 8);
  const auto decoded = decoder.decode(body_of(packet));
  ASSERT_TRUE(decoded.frame);
  EXPECT_EQ(decoded.frame->frame_number, 7);
  EXPECT_NEAR(decoded.frame->latency_s, 0.005, 1e-12);
  EXPECT_NEAR(decoded.frame->rate_hz, 120, 1e-6);
  ASSERT_EQ(decoded.frame->markers.size(), 3u);
  const auto& unlabelled = decoded.frame->markers[0];
  EXPECT_TRUE(unlabelled.name.empty());
  EXPECT_TRUE(unlabelled.position_m.isApprox(Eigen::Vector3d(1, 2, 3)));
  EXPECT_EQ(decoded.frame->markers[2].name, "right");
  EXPECT_EQ(decoded.frame->markers[2].subject, "fabric");
  EXPECT_TRUE(decoded.frame->markers[2].position_m.isApprox(Eigen::Vector3d(0.4, -0.2, 1.5)));
}

TEST(DatastreamPackets, EchoOfAPingIsRead) {
  Decoder decoder;
  EXPECT_EQ(decoder.decode(body_of(datastream_server::ping_packet(77))).ping, 77u);
}

TEST(DatastreamPackets, AbsentMarkerIsOccludedAndNeverAtTheOrigin) {
  datastream_server::Declared declared;
  Decoder decoder;
  decoder.decode(body_of(datastream_server::frame_packet(two_corners(), declared, true)));
  auto hidden = two_corners();
  hidden.seen.erase(hidden.seen.begin());
  auto zero = two_corners();
  zero.seen[0].position_m.setZero();  // what some servers write for a marker they did not see
  for (const auto& frame : {hidden, zero}) {
    const auto decoded = decoder.decode(body_of(datastream_server::frame_packet(frame, declared, false)));
    ASSERT_TRUE(decoded.frame);
    ASSERT_EQ(decoded.frame->markers.size(), 3u);
    const auto& left = decoded.frame->markers[1];
    EXPECT_EQ(left.name, "left");
    EXPECT_TRUE(left.occluded);
    EXPECT_TRUE(left.position_m.hasNaN());
    EXPECT_FALSE(decoded.frame->markers[2].occluded);
  }
}

TEST(DatastreamPackets, AbsurdLengthIsRefused) {
  wire::LittleWriter header;
  header.number<std::uint32_t>(0x1a2b0001).number<std::uint32_t>(0xffffffff);
  EXPECT_THROW(tracker::datastream::packet_length(header.bytes()), wire::WireError);

  wire::LittleWriter body;  // four thousand million markers in twelve bytes
  body.number<std::uint32_t>(6).number<std::uint32_t>(4).number<std::uint32_t>(0xffffffff);
  EXPECT_THROW(Decoder().decode(body.bytes()), wire::WireError);
}

TEST(DatastreamPackets, EveryTruncationIsRefusedOrRead) {
  datastream_server::Declared declared;
  const auto packet = datastream_server::frame_packet(two_corners(), declared, true);
  int refused = 0;
  for (size_t length = 0; length + 8 < packet.size(); ++length) {
    Decoder decoder;
    try {
      decoder.decode(body_of(packet).first(length));
    } catch (const wire::WireError&) { ++refused; }
  }
  EXPECT_GT(refused, static_cast<int>(packet.size()) / 2);
}

TEST(DatastreamPackets, SurvivesDamagedAndRandomBytes) {
  datastream_server::Declared declared;
  const auto sound = datastream_server::frame_packet(two_corners(), declared, true);
  std::mt19937 random(20);
  int read = 0, refused = 0;
  for (int round = 0; round < 50000; ++round) {
    std::vector<std::uint8_t> bytes(body_of(sound).begin(), body_of(sound).end());
    if (round % 4 == 0)
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    else
      for (unsigned i = 0; i <= random() % 8; ++i) bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    try {
      const auto decoded = Decoder().decode(bytes);
      ++read;
      if (!decoded.frame) continue;
      for (const auto& marker : decoded.frame->markers) {
        ASSERT_EQ(marker.occluded, marker.position_m.hasNaN());
        ASSERT_FALSE(marker.position_m.isZero(0));
      }
    } catch (const wire::WireError&) { ++refused; }
  }
  EXPECT_GT(read, 1000);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace selvedge
