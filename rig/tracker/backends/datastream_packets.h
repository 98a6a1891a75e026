// Decoding what a Vicon DataStream ("CGStream") server sends.
//
// Little-endian, packed. A packet is a block {u32 id 0x1a2b0001, u32 length} of object blocks {u32 id,
// u32 length, body}; unknown ids are skipped by length, and bodies may be longer than what is read here.
// A labelled marker that SubjectInfo declares and that is absent from LabeledRecons was not seen: the wire has
// no other sign of occlusion. Positions are millimetres on the wire, metres here.
// Source: Vicon DataStream SDK 1.12 (MIT), ViconCGStream/*.h.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "rig/tracker/tracker.h"
#include "rig/wire/bytes.h"

namespace selvedge::tracker::datastream {

inline constexpr std::uint32_t packet_id = 0x1a2b0001;
inline constexpr std::uint32_t stream_info = 1, subject_info = 2, frame_info = 5, labelled_recons = 6,
                               unlabelled_recons = 7, latency_info = 26, ping = 42, object_enums = 100001,
                               request_frame = 100002, contents = 100004;
inline constexpr size_t header_bytes = 8;
inline constexpr size_t largest_packet_bytes = 8 << 20;  // far above any single-marker set-up

// Length of the packet body that a header of 8 bytes announces. Throws WireError where it is not a packet or
// longer than largest_packet_bytes.
size_t packet_length(std::span<const std::uint8_t> header);

// Keeps what the server sent once (names, rate) from packet to packet.
class Decoder {
 public:
  struct Packet {
    std::optional<std::set<std::uint32_t>> supported;  // the server's ObjectEnums
    std::optional<TrackerFrame> frame;                 // where the packet holds FrameInfo; times not filled in
    std::optional<std::uint64_t> ping;                 // of ours, echoed
  };
  // body: a packet without its 8-byte header. Throws WireError.
  Packet decode(std::span<const std::uint8_t> body);

 private:
  struct Subject {
    std::string name;
    std::map<std::uint32_t, std::string> markers;
  };
  void read_subject(wire::LittleReader body, std::map<std::uint32_t, Subject>& subjects) const;

  std::map<std::uint32_t, Subject> subjects_;
  double rate_hz_ = 0;
};

}  // namespace selvedge::tracker::datastream
