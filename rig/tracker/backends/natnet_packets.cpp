#include "rig/tracker/backends/natnet_packets.h"

#include <algorithm>
#include <cstring>
#include <optional>

namespace selvedge::tracker::natnet {
namespace {

using wire::LittleReader;
using wire::WireError;

constexpr size_t kNameField = 256, kRigidBody = 38, kLabelledMarker = 26, kLongestText = 1024;
constexpr int kOccluded = 1 << 0, kModelFilled = 1 << 2, kUnlabelled = 1 << 4, kModelListChanged = 1 << 1;
constexpr int kMarkerSet = 0, kRigidBodySet = 1;

bool at_least(const ServerInfo& server, int major, int minor) {
  return server.version[0] > major || (server.version[0] == major && server.version[1] >= minor);
}

std::string read_text(LittleReader& reader) {
  std::string text;
  for (;;) {
    const auto letter = reader.number<std::uint8_t>();
    if (letter == 0) return text;
    if (text.size() >= kLongestText) throw WireError("natnet: a text without end");
    text += static_cast<char>(letter);
  }
}

std::int32_t read_count(LittleReader& reader, size_t element_bytes) {
  const auto count = reader.number<std::int32_t>();
  if (count < 0 || static_cast<std::uint64_t>(count) * element_bytes > reader.left())
    throw WireError(
        fmt::format("natnet: {} elements of {} bytes announced, {} bytes left", count, element_bytes, reader.left()));
  return count;
}

// Count of a frame's section; from 4.1 its length in bytes follows.
struct Section {
  std::int32_t count;
  LittleReader body;
  bool bounded;  // body holds this section alone
};
Section open_section(LittleReader& frame, const ServerInfo& server, size_t element_bytes) {
  const auto count = read_count(frame, at_least(server, 4, 1) ? 0 : element_bytes);
  if (!at_least(server, 4, 1)) return {count, frame, false};
  const auto bytes = frame.number<std::int32_t>();
  if (bytes < 0) throw WireError(fmt::format("natnet: a section of {} bytes", bytes));
  return {count, frame.part(static_cast<size_t>(bytes)), true};
}
// Goes on behind a section that was read to its end.
void close_section(LittleReader& frame, const Section& section) {
  if (!section.bounded) frame = section.body;
}

// As on the wire: compared bit by bit between sections.
using WirePosition = std::array<float, 3>;
WirePosition read_position(LittleReader& reader) {
  return {reader.number<float>(), reader.number<float>(), reader.number<float>()};
}
Eigen::Vector3d to_metres(const WirePosition& p) {
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

using MarkerSets = std::map<std::string, std::vector<WirePosition>>;

MarkerSets read_marker_sets(LittleReader& frame, const ServerInfo& server) {
  MarkerSets sets;
  Section section = open_section(frame, server, 5);
  for (int i = 0; i < section.count; ++i) {
    auto& positions = sets[read_text(section.body)];
    const auto count = read_count(section.body, 12);
    for (int k = 0; k < count; ++k) positions.push_back(read_position(section.body));
  }
  close_section(frame, section);
  return sets;
}

void skip_fixed(LittleReader& frame, const ServerInfo& server, size_t element_bytes) {
  Section section = open_section(frame, server, element_bytes);
  if (!section.bounded) section.body.take(static_cast<size_t>(section.count) * element_bytes);
  close_section(frame, section);
}

void skip_skeletons(LittleReader& frame, const ServerInfo& server) {
  Section section = open_section(frame, server, 8);
  for (int i = 0; !section.bounded && i < section.count; ++i) {
    section.body.take(4);
    section.body.take(static_cast<size_t>(read_count(section.body, kRigidBody)) * kRigidBody);
  }
  close_section(frame, section);
}

void skip_analogue(LittleReader& frame, const ServerInfo& server) {
  Section section = open_section(frame, server, 8);
  for (int i = 0; !section.bounded && i < section.count; ++i) {
    section.body.take(4);
    const auto channels = read_count(section.body, 4);
    for (int channel = 0; channel < channels; ++channel)
      section.body.take(static_cast<size_t>(read_count(section.body, 4)) * 4);
  }
  close_section(frame, section);
}

struct Labelled {
  std::int32_t asset, member;  // of the asset, from 1
  WirePosition position;
  int params;
};
std::vector<Labelled> read_labelled(LittleReader& frame, const ServerInfo& server) {
  std::vector<Labelled> markers;
  Section section = open_section(frame, server, kLabelledMarker);
  for (int i = 0; i < section.count; ++i) {
    const auto id = section.body.number<std::int32_t>();
    Labelled marker{id >> 16, id & 0xffff, read_position(section.body), 0};
    section.body.take(4);  // size
    marker.params = section.body.number<std::int16_t>();
    section.body.take(4);  // residual
    markers.push_back(marker);
  }
  close_section(frame, section);
  return markers;
}

bool is_measurement(const Eigen::Vector3d& p) { return p.allFinite() && !p.isZero(0); }

// The position of a set's marker in the set, or, where the set is not in the frame, of the labelled marker with its id.
std::optional<WirePosition> position_of(const MarkerSets& sets, const std::vector<Labelled>& labelled,
                                        const Model& model, const std::string& set, size_t i) {
  if (const auto positions = sets.find(set); positions != sets.end()) {
    if (i < positions->second.size()) return positions->second[i];
    return std::nullopt;
  }
  for (const Labelled& marker : labelled) {
    const auto asset = model.assets.find(marker.asset);
    if (asset != model.assets.end() && asset->second == set && marker.member == static_cast<std::int32_t>(i) + 1)
      return marker.position;
  }
  return std::nullopt;
}

// Each named marker beside the measured position that equals its own; what is measured and has no name.
std::vector<TrackedMarker> name_markers(const MarkerSets& sets, const std::vector<Labelled>& labelled,
                                        const Model& model) {
  std::vector<TrackedMarker> markers;
  for (const auto& [set, names] : model.sets) {
    if (set == "all") continue;
    for (size_t i = 0; i < names.size(); ++i) {
      TrackedMarker marker{.subject = set, .name = names[i]};
      if (const auto here = position_of(sets, labelled, model, set, i)) {
        const bool measured = std::any_of(labelled.begin(), labelled.end(), [&](const Labelled& candidate) {
          return (candidate.params & (kOccluded | kModelFilled | kUnlabelled)) == 0 && candidate.position == *here;
        });
        if (measured && is_measurement(to_metres(*here))) {
          marker.position_m = to_metres(*here);
          marker.occluded = false;
        }
      }
      markers.push_back(std::move(marker));
    }
  }
  for (const Labelled& marker : labelled)
    if ((marker.params & kUnlabelled) != 0 && (marker.params & (kOccluded | kModelFilled)) == 0 &&
        is_measurement(to_metres(marker.position)))
      markers.push_back({.subject = "", .name = "", .position_m = to_metres(marker.position), .occluded = false});
  return markers;
}

}  // namespace

std::vector<std::uint8_t> encode(std::uint16_t id, const wire::LittleWriter& payload) {
  wire::LittleWriter message;
  message.number<std::uint16_t>(id)
      .number<std::uint16_t>(static_cast<std::uint16_t>(payload.size()))
      .raw(payload.bytes());
  return message.bytes();
}

wire::LittleWriter connect_payload() {
  const std::string name = "selvedge";
  wire::LittleWriter payload;
  payload.text(name);
  while (payload.size() < kNameField) payload.number<std::uint8_t>(0);
  for (const std::uint8_t part : {1, 0, 0, 0, 3, 0, 0, 0}) payload.number<std::uint8_t>(part);  // ours, NatNet's
  return payload;
}

Message take_message(std::span<const std::uint8_t> datagram) {
  LittleReader reader(datagram);
  Message message;
  message.id = reader.number<std::uint16_t>();
  const auto length = reader.number<std::uint16_t>();
  if (length > reader.left())
    throw WireError(fmt::format("natnet: {} bytes announced, {} there", length, reader.left()));
  message.payload = reader.take(length);
  return message;
}

ServerInfo decode_server_info(std::span<const std::uint8_t> payload) {
  LittleReader reader(payload);
  ServerInfo info;
  reader.take(kNameField + 4);  // name, application's version
  for (int& part : info.version) part = reader.number<std::uint8_t>();
  info.ticks_per_s = static_cast<double>(reader.number<std::uint64_t>());
  info.data_port = reader.number<std::uint16_t>();
  info.multicast = reader.number<std::uint8_t>() != 0;
  std::array<int, 4> group{};
  for (int& part : group) part = reader.number<std::uint8_t>();
  info.group = fmt::format("{}.{}.{}.{}", group[0], group[1], group[2], group[3]);
  if (!at_least(info, 3, 0) || info.version[0] > 4)
    throw WireError(fmt::format("natnet: bitstream {}.{}, 3.0 to 4.x expected", info.version[0], info.version[1]));
  if (!(info.ticks_per_s > 0)) throw WireError("natnet: the server's clock has no rate");
  return info;
}

Model decode_model(std::span<const std::uint8_t> payload, const ServerInfo& server) {
  LittleReader reader(payload);
  Model model;
  const auto count = read_count(reader, 4);
  for (int i = 0; i < count; ++i) {
    const auto type = reader.number<std::int32_t>();
    const bool sized = at_least(server, 4, 1);
    LittleReader body = reader;
    if (sized) {
      const auto bytes = reader.number<std::int32_t>();
      if (bytes < 0) throw WireError(fmt::format("natnet: a data set of {} bytes", bytes));
      body = reader.part(static_cast<size_t>(bytes));
    }
    if (type == kMarkerSet) {
      auto& names = model.sets[read_text(body)];
      const auto markers = read_count(body, 1);
      for (int k = 0; k < markers; ++k) names.push_back(read_text(body));
    } else if (type == kRigidBodySet) {
      std::string name = read_text(body);
      model.assets[body.number<std::int32_t>()] = std::move(name);
      if (!sized) {
        body.take(4 + 12);  // parent, offset from it
        const auto markers = read_count(body, 12 + 4);
        body.take(static_cast<size_t>(markers) * (12 + 4));  // place, active label
        for (int k = 0; at_least(server, 4, 0) && k < markers; ++k) read_text(body);
      }
    } else if (!sized) {
      break;  // skeletons and devices follow the rest; without sizes there is no way past them
    }
    if (!sized) reader = body;
  }
  return model;
}

Frame decode_frame(std::span<const std::uint8_t> payload, const ServerInfo& server, const Model& model) {
  LittleReader reader(payload);
  Frame frame;
  frame.number = reader.number<std::int32_t>();
  const MarkerSets sets = read_marker_sets(reader, server);
  skip_fixed(reader, server, 12);  // other markers, kept for old clients
  skip_fixed(reader, server, kRigidBody);
  skip_skeletons(reader, server);
  if (at_least(server, 4, 1)) skip_fixed(reader, server, 0);  // assets
  const auto labelled = read_labelled(reader, server);
  skip_analogue(reader, server);  // force plates
  skip_analogue(reader, server);  // other devices
  reader.take(4 + 4 + 8);         // time code, time stamp
  frame.exposure_ticks = reader.number<std::uint64_t>();
  reader.take(8);  // camera data received
  frame.transmit_ticks = reader.number<std::uint64_t>();
  if (at_least(server, 4, 1)) reader.take(8);  // PTP
  frame.model_changed = (reader.number<std::int16_t>() & kModelListChanged) != 0;
  if (reader.number<std::uint32_t>() != 0) throw WireError("natnet: no end-of-data mark where it should be");
  frame.markers = name_markers(sets, labelled, model);
  return frame;
}

}  // namespace selvedge::tracker::natnet
