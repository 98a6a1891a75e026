// Numbers on the wire of USB3 Vision: least significant byte first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace selvedge::sim {

inline void put_little(std::vector<uint8_t>& bytes, uint64_t value, size_t count) {
  for (size_t i = 0; i < count; ++i) bytes.push_back(static_cast<uint8_t>(value >> (8 * i)));
}
inline uint64_t get_little(const uint8_t* bytes, size_t count) {
  uint64_t value = 0;
  for (size_t i = count; i-- > 0;) value = value << 8 | bytes[i];
  return value;
}

}  // namespace selvedge::sim
