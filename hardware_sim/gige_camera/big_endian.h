// Numbers on the wire of GigE Vision: most significant byte first.
#pragma once

#include <cstdint>
#include <vector>

namespace selvedge::sim {

inline void put16(std::vector<uint8_t>& bytes, uint16_t value) {
  bytes.push_back(static_cast<uint8_t>(value >> 8));
  bytes.push_back(static_cast<uint8_t>(value));
}

inline void put32(std::vector<uint8_t>& bytes, uint32_t value) {
  put16(bytes, static_cast<uint16_t>(value >> 16));
  put16(bytes, static_cast<uint16_t>(value));
}

}  // namespace selvedge::sim
