// Packets between the window back-end and its program: bit 0 of the first byte says which end reads.
#include "rig/projector/backends/window_packets.h"
#include "rig/wire/bytes.h"

using namespace selvedge;
using namespace selvedge::projector;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  const std::span<const uint8_t> packet(data + 1, size - 1);
  try {
    if ((data[0] & 1) != 0) {
      window::decode_answer(packet);
      return 0;
    }
    // What was let through must be drawable.
    const window::Request request = window::decode_request(packet);
    for (const double at : {0.0, 1.0, 911.0, 4095.0}) brightness(request.pattern, at, 4095 - at);
  } catch (const wire::WireError&) {}
  return 0;
}
