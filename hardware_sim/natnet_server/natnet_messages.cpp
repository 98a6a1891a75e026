#include "hardware_sim/natnet_server/natnet_messages.h"

#include <algorithm>

#include "rig/wire/bytes.h"

namespace selvedge::hardware_sim::natnet {

namespace {

using wire::LittleWriter;

constexpr std::int16_t kSolved = 1 << 1, kFilled = 1 << 2, kHasModel = 1 << 3, kUnlabelled = 1 << 4;

void put_text(LittleWriter& out, const std::string& text) { out.text(text).number<std::uint8_t>(0); }

void put_position(LittleWriter& out, const Eigen::Vector3d& p) {
  for (int axis = 0; axis < 3; ++axis) out.number<float>(static_cast<float>(p[axis]));
}

void put_section(LittleWriter& out, const Bitstream& bitstream, size_t count, const LittleWriter& body) {
  out.number<std::int32_t>(static_cast<std::int32_t>(count));
  if (bitstream.sized()) out.number<std::int32_t>(static_cast<std::int32_t>(body.size()));
  out.raw(body.bytes());
}

const NamedPoint* find(const std::vector<NamedPoint>& seen, const std::string& set, const std::string& name) {
  const auto found =
      std::find_if(seen.begin(), seen.end(), [&](const NamedPoint& p) { return p.subject == set && p.name == name; });
  return found == seen.end() ? nullptr : &*found;
}

void put_labelled(LittleWriter& out, std::int32_t id, const Eigen::Vector3d& position, std::int16_t params) {
  out.number<std::int32_t>(id);
  put_position(out, position);
  out.number<float>(0.014F).number<std::int16_t>(params).number<float>(5e-5F);
}

}  // namespace

std::vector<std::uint8_t> message(std::uint16_t id, const std::vector<std::uint8_t>& payload) {
  LittleWriter out;
  out.number<std::uint16_t>(id).number<std::uint16_t>(static_cast<std::uint16_t>(payload.size())).raw(payload);
  return out.bytes();
}

std::vector<std::uint8_t> server_info(const Bitstream& bitstream, double ticks_per_s) {
  LittleWriter out;
  out.text("Simulated Motive");
  while (out.size() < 256) out.number<std::uint8_t>(0);
  for (const int part : {2, 1, 0, 0, bitstream.major, bitstream.minor, 0, 0})
    out.number<std::uint8_t>(static_cast<std::uint8_t>(part));
  out.number<std::uint64_t>(static_cast<std::uint64_t>(ticks_per_s))
      .number<std::uint16_t>(1511)
      .number<std::uint8_t>(0);
  for (const int part : {239, 255, 42, 99}) out.number<std::uint8_t>(static_cast<std::uint8_t>(part));
  return message(1, out.bytes());
}

std::vector<std::uint8_t> model_definition(const Bitstream& bitstream, const MarkerSets& sets) {
  LittleWriter out;
  out.number<std::int32_t>(static_cast<std::int32_t>(sets.size()));
  for (const auto& [set, names] : sets) {
    LittleWriter body;
    put_text(body, set);
    body.number<std::int32_t>(static_cast<std::int32_t>(names.size()));
    for (const auto& name : names) put_text(body, name);
    out.number<std::int32_t>(0);
    if (bitstream.sized()) out.number<std::int32_t>(static_cast<std::int32_t>(body.size()));
    out.raw(body.bytes());
  }
  return message(5, out.bytes());
}

std::vector<std::uint8_t> frame(const Bitstream& bitstream, std::int32_t number, const MarkerSets& sets,
                                const std::vector<NamedPoint>& seen, bool fill_hidden, bool model_changed,
                                const FrameTicks& ticks) {
  LittleWriter out, marker_sets, labelled;
  size_t labelled_count = 0;
  std::int32_t asset = 0;
  for (const auto& [set, names] : sets) {
    put_text(marker_sets, set);
    marker_sets.number<std::int32_t>(static_cast<std::int32_t>(names.size()));
    ++asset;
    for (size_t i = 0; i < names.size(); ++i) {
      const NamedPoint* point = find(seen, set, names[i]);
      const NamedPoint guess{set, names[i], Eigen::Vector3d(0.5, 0.5, 0.5)};
      put_position(marker_sets, point ? point->position_m : fill_hidden ? guess.position_m : Eigen::Vector3d::Zero());
      if (point == nullptr && !fill_hidden) continue;
      put_labelled(labelled, asset << 16 | static_cast<std::int32_t>(i + 1), (point ? *point : guess).position_m,
                   static_cast<std::int16_t>(kHasModel | (point ? kSolved : kFilled)));
      ++labelled_count;
    }
  }
  for (const auto& point : seen)
    if (point.name.empty())
      put_labelled(labelled, 50000 + static_cast<std::int32_t>(labelled_count++), point.position_m,
                   kSolved | kUnlabelled);

  const LittleWriter none;
  out.number<std::int32_t>(number);
  put_section(out, bitstream, sets.size(), marker_sets);
  for (int section = 0; section < (bitstream.sized() ? 4 : 3); ++section)
    put_section(out, bitstream, 0, none);  // others … assets
  put_section(out, bitstream, labelled_count, labelled);
  for (int section = 0; section < 2; ++section) put_section(out, bitstream, 0, none);  // force plates, devices
  out.number<std::uint32_t>(0).number<std::uint32_t>(0).number<double>(1e-7 * static_cast<double>(ticks.exposure));
  out.number<std::uint64_t>(ticks.exposure).number<std::uint64_t>(ticks.received).number<std::uint64_t>(ticks.transmit);
  if (bitstream.sized()) out.number<std::uint64_t>(0);
  out.number<std::int16_t>(model_changed ? 2 : 0).number<std::uint32_t>(0);
  return message(7, out.bytes());
}

}  // namespace selvedge::hardware_sim::natnet
