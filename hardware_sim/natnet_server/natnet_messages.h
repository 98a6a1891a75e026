// Writing the server's side of NatNet.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "hardware_sim/simulated_mocap/simulated_mocap.h"

namespace selvedge::hardware_sim::natnet {

struct Bitstream {
  int major = 3, minor = 0;
  bool sized() const { return major > 4 || (major == 4 && minor >= 1); }  // sections say their length
};

// Names that have been seen so far, set by set, in the order of their appearance.
using MarkerSets = std::vector<std::pair<std::string, std::vector<std::string>>>;

struct FrameTicks {
  std::uint64_t exposure = 0, received = 0, transmit = 0;
};

std::vector<std::uint8_t> message(std::uint16_t id, const std::vector<std::uint8_t>& payload);
std::vector<std::uint8_t> server_info(const Bitstream& bitstream, double ticks_per_s);
std::vector<std::uint8_t> model_definition(const Bitstream& bitstream, const MarkerSets& sets);
// fill_hidden: a marker of a set that is not in `seen` appears at the set's first seen position, flagged as filled.
std::vector<std::uint8_t> frame(const Bitstream& bitstream, std::int32_t number, const MarkerSets& sets,
                                const std::vector<NamedPoint>& seen, bool fill_hidden, bool model_changed,
                                const FrameTicks& ticks);

}  // namespace selvedge::hardware_sim::natnet
