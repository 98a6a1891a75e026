// Writing the server's side of DataStream: what it supports, and one frame as a packet.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "hardware_sim/datastream_server/datastream_server.h"

namespace selvedge::hardware_sim::datastream {

// Names that the server has declared, in the order in which they appeared; ids are places in it, from 1.
struct Declared {
  std::vector<std::string> subjects;
  std::vector<std::vector<std::string>> markers;  // per subject
  // Ids of a marker, declared now where it is new. Returns {subject id, marker id}.
  std::pair<std::uint32_t, std::uint32_t> ids(const std::string& subject, const std::string& name);
  int generation = 0;  // rises with every new name
};

struct Frame {
  std::uint32_t number = 0;
  double latency_s = 0;
  double rate_hz = 0;
  std::vector<NamedPoint> seen;
};

std::vector<std::uint8_t> supported_packet();
// with_static: StreamInfo and every SubjectInfo too.
std::vector<std::uint8_t> frame_packet(const Frame& frame, Declared& declared, bool with_static);
// Answer to a Ping: the same number back.
std::vector<std::uint8_t> ping_packet(std::uint64_t id);

}  // namespace selvedge::hardware_sim::datastream
