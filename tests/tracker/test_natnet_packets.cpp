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
  const auto decoded =
      decode(frame({{"fabric", "right", {1, 2, 3}}, {"fabric", "left", {-1, 0, 2}}, {"", "", {5, 6, 7}}}));
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
      for (const auto& marker : natnet_client::decode_frame(message.payload, info, model).markers)
        ASSERT_EQ(marker.occluded, marker.position_m.hasNaN());
    } catch (const wire::WireError&) { ++refused; }
  }
  EXPECT_GT(read, 100);
  EXPECT_GT(refused, 1000);
}

// As Motive 2.1 sends them where rigid bodies are streamed and marker sets are not: the body's description comes before
// that of its marker set, and frames name markers by id alone.
TEST(NatnetAssets, MarkersAreNamedByIdWhereMarkerSetsAreNotStreamed) {
  natnet_client::ServerInfo info;
  info.version = {3, 0, 0, 0};
  info.ticks_per_s = 1e7;
  wire::LittleWriter model;
  model.number<std::int32_t>(2);
  model.number<std::int32_t>(1).text("fabric").number<std::uint8_t>(0).number<std::int32_t>(7).number<std::int32_t>(-1);
  for (int i = 0; i < 3; ++i) model.number<float>(0);
  model.number<std::int32_t>(2);
  for (int i = 0; i < 6; ++i) model.number<float>(0.1F);
  for (int i = 0; i < 2; ++i) model.number<std::int32_t>(0);
  model.number<std::int32_t>(0).text("fabric").number<std::uint8_t>(0).number<std::int32_t>(3);
  for (const char* name : {"left", "right", "middle"}) model.text(name).number<std::uint8_t>(0);
  const natnet_client::Model decoded = natnet_client::decode_model(model.bytes(), info);
  EXPECT_EQ(decoded.sets.at("fabric"), (std::vector<std::string>{"left", "right", "middle"}));
  EXPECT_EQ(decoded.assets.at(7), "fabric");

  wire::LittleWriter frame;
  frame.number<std::int32_t>(17);
  for (int section = 0; section < 4; ++section)
    frame.number<std::int32_t>(0);  // marker sets, others, bodies, skeletons
  frame.number<std::int32_t>(4);
  const auto labelled = [&](int asset, int member, float x, int params) {
    frame.number<std::int32_t>(asset << 16 | member)
        .number<float>(x)
        .number<float>(2)
        .number<float>(3)
        .number<float>(0.01F);
    frame.number<std::int16_t>(static_cast<std::int16_t>(params)).number<float>(0);
  };
  labelled(7, 2, 1, 8 | 2);
  labelled(7, 1, -1, 8 | 4);      // filled in by the model
  labelled(7, 3, -1, 8 | 2 | 1);  // occluded, with a position nevertheless
  labelled(0, 51, 5, 16 | 2);
  for (int section = 0; section < 2; ++section) frame.number<std::int32_t>(0);  // force plates, devices
  frame.number<std::uint32_t>(0).number<std::uint32_t>(0).number<double>(0.5);
  for (const std::uint64_t ticks : {1000U, 1500U, 2000U}) frame.number<std::uint64_t>(ticks);
  frame.number<std::int16_t>(0).number<std::uint32_t>(0);
  const auto markers = natnet_client::decode_frame(frame.bytes(), info, decoded).markers;
  ASSERT_EQ(markers.size(), 4u);
  EXPECT_TRUE(markers[0].occluded);
  EXPECT_EQ(markers[1].name, "right");
  EXPECT_TRUE(markers[1].position_m.isApprox(Eigen::Vector3d(1, 2, 3)));
  EXPECT_TRUE(markers[2].occluded);
  EXPECT_TRUE(markers[3].name.empty());
  EXPECT_FALSE(markers[3].occluded);
}

INSTANTIATE_TEST_SUITE_P(Bitstreams, NatnetPackets,
                         testing::Values(natnet_server::Bitstream{3, 0}, natnet_server::Bitstream{4, 1}),
                         [](const auto& info) {
  return std::to_string(info.param.major) + "_" + std::to_string(info.param.minor);
});

}  // namespace
}  // namespace selvedge
