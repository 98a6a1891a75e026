// Bound on the array sizes that a received message states: an element takes at least one byte on the wire,
// so a size beyond the bytes received is a lie. The generated decoders call this before they allocate.
#pragma once

#include <cstdint>
#include <stdexcept>

namespace selvedge::rig {

inline int64_t bounded_size(int64_t stated, int64_t bytes_left) {
  if (stated < 0 || stated > bytes_left) throw std::length_error("array size beyond the message");
  return stated;
}

}  // namespace selvedge::rig
