// Decoding what an OptiTrack NatNet server sends, bitstream 3.0 to 4.3.
//
// UDP, little-endian, packed: u16 message id, u16 payload bytes, payload; strings end with NUL. From 4.1 each section
// of a frame says its length in bytes after its count. Single markers are read from the labelled-marker section,
// where every marker appears; a marker of an asset carries its name where its position equals that of the asset's
// marker set, whose names the model definition lists in the same order, or, where marker sets are not streamed, where
// its id is that of the asset and its place in that list. A marker that is missing there, is flagged as occluded, or
// whose position was filled in by the model, was not seen. Sources: python_natnet (BSD-3), NatNetSDKCrossplatform's
// PacketClientHelper (MIT).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "rig/tracker/tracker.h"
#include "rig/wire/bytes.h"

namespace selvedge::tracker::natnet {

inline constexpr std::uint16_t connect = 0, server_info = 1, request = 2, response = 3, request_model = 4,
                               model_definition = 5, frame_of_data = 7, keep_alive = 10, echo_request = 12,
                               echo_response = 13;

std::vector<std::uint8_t> encode(std::uint16_t id, const wire::LittleWriter& payload);
wire::LittleWriter connect_payload();

struct Message {
  std::uint16_t id = 0;
  std::span<const std::uint8_t> payload;
};
// Throws WireError where the header's length is not the datagram's.
Message take_message(std::span<const std::uint8_t> datagram);

struct ServerInfo {
  std::array<int, 4> version{};  // of the bitstream
  double ticks_per_s = 0;
  int data_port = 0;
  bool multicast = false;
  std::string group;
};
ServerInfo decode_server_info(std::span<const std::uint8_t> payload);

struct Model {
  std::map<std::string, std::vector<std::string>> sets;  // names of each marker set, in the order of its markers
  std::map<std::int32_t, std::string> assets;            // rigid bodies by id; each has a marker set of its name
};
Model decode_model(std::span<const std::uint8_t> payload, const ServerInfo& server);

struct Frame {
  std::int64_t number = 0;
  std::uint64_t exposure_ticks = 0, transmit_ticks = 0;  // server clock
  bool model_changed = false;
  std::vector<TrackedMarker> markers;
};
Frame decode_frame(std::span<const std::uint8_t> payload, const ServerInfo& server, const Model& model);

}  // namespace selvedge::tracker::natnet
