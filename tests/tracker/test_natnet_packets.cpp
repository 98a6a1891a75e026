#include <gtest/gtest.h>

#include <random>

#include "hardware_sim/natnet_server/natnet_messages.h"
#include "rig/tracker/backends/natnet_packets.h"

namespace selvedge {
namespace {

namespace natnet_client = tracker::natnet;
namespace natnet_server = hardware_sim::natnet;

const natnet_server::MarkerSets kSets{{"fabric", {"left", "right"}}, {"grid", {"g0_0"}}};

class NatnetPackets : public testing::TestWithParam<natnet_server::Bitstream> {
 protected:
  std::vector<std::uint8_t> frame(const std::vector<hardware_sim::NamedPoint>& seen, bool fill_hidden = false) const {
    return natnet_server::frame(GetParam(), 17, kSets, seen, fill_hidden, false, {1000, 1500, 2000});
  }
  natnet_client::Frame decode(const std::vector<std::uint8_t>& datagram) const {
    const auto info = natnet_client::decode_server_info(natnet_client::take_message(info_).payload);
    const auto model = natnet_client::decode_model(natnet_client::take_message(model_).payload, info);
    return natnet_client::decode_frame(natnet_client::take_message(datagram).payload, info, model);
  }
  const std::vector<std::uint8_t> info_ = natnet_server::server_info(GetParam(), 1e7);
  const std::vector<std::uint8_t> model_ = natnet_server::model_definition(GetParam(), kSets);
};

TEST_P(NatnetPackets, GiveNamesPositionsAndTicks) {
  const auto info = natnet_client::decode_server_info(natnet_client::take_message(info_).payload);
  EXPECT_EQ(info.version[0], GetParam().major);
  EXPECT_EQ(info.ticks_per_s, 1e7);
  EXPECT_FALSE(info.multicast);
  EXPECT_EQ(info.group, "239.255.42.99");
  const auto decoded = decode(frame({{"fabric", "right", {1, 2, 3}}, {"fabric", "left", {-1, 0, 2}}, {"", "", {5, 6, 7}}}));
  EXPECT_EQ(decoded.number, 17);
  EXPECT_EQ(decoded.exposure_ticks, 1000u);
  EXPECT_EQ(decoded.transmit_ticks, 2000u);
  ASSERT_EQ(decoded.markers.size(), 4u);
  EXPECT_EQ(decoded.markers[0].name, "left");
  EXPECT_TRUE(decoded.markers[0].position_m.isApprox(Eigen::Vector3d(-1, 0, 2)));
  EXPECT_TRUE(decoded.markers[1].position_m.isApprox(Eigen::Vector3d(1, 2, 3)));
  EXPECT_EQ(decoded.markers[2].subject, "grid");
  EXPECT_TRUE(decoded.markers[2].occluded);
  EXPECT_TRUE(decoded.markers[3].name.empty());
}

TEST_P(NatnetPackets, MissingAndFilledInMarkersAreOccluded) {
  for (const bool fill_hidden : {false, true}) {
    const auto decoded = decode(frame({{"fabric", "right", {1, 2, 3}}}, fill_hidden));
    ASSERT_EQ(decoded.markers.size(), 3u);
    EXPECT_TRUE(decoded.markers[0].occluded);
    EXPECT_TRUE(decoded.markers[0].position_m.hasNaN());
    EXPECT_FALSE(decoded.markers[1].occluded);
    EXPECT_TRUE(decoded.markers[2].occluded);
  }
}

TEST_P(NatnetPackets, SurviveDamagedTruncatedAndRandomBytes) {
  const auto info = natnet_client::decode_server_info(natnet_client::take_message(info_).payload);
  const auto model = natnet_client::decode_model(natnet_client::take_message(model_).payload, info);
  const auto sound = frame({{"fabric", "right", {1, 2, 3}}, {"fabric", "left", {-1, 0, 2}}, {"", "", {5, 6, 7}}});
  std::mt19937 random(6);
  int read = 0, refused = 0;
  for (int round = 0; round < 100000; ++round) {
    auto bytes = round % 3 == 0 ? model_ : sound;
    for (unsigned i = 0; i <= random() % 6; ++i) bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    if (round % 4 == 0) bytes.resize(random() % bytes.size());
    if (round % 7 == 0)
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    try {
      const auto message = natnet_client::take_message(bytes);
      natnet_client::decode_model(message.payload, info);
      ++read;
      for (const auto& marker : natnet_client::decode_frame(message.payload, info, model).markers) ASSERT_EQ(marker.occluded, marker.position_m.hasNaN());
    } catch (const wire::WireError&) {
      ++refused;
    }
  }
  EXPECT_GT(read, 100);
  EXPECT_GT(refused, 1000);
}

INSTANTIATE_TEST_SUITE_P(Bitstreams, NatnetPackets, testing::Values(natnet_server::Bitstream{3, 0}, natnet_server::Bitstream{4, 1}),
                         [](const auto& info) { return std::to_string(info.param.major) + "_" + std::to_string(info.param.minor); });

}  // namespace
}  // namespace selvedge
