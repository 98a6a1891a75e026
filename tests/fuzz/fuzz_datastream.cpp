#include "rig/tracker/backends/datastream_packets.h"

using namespace selvedge;

// Packets one after another through one decoder, as a connection would bring them.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  tracker::datastream::Decoder decoder;
  std::span<const uint8_t> left(data, size);
  try {
    while (left.size() >= tracker::datastream::header_bytes) {
      const size_t length = tracker::datastream::packet_length(left.first(tracker::datastream::header_bytes));
      left = left.subspan(tracker::datastream::header_bytes);
      if (left.size() < length) break;
      decoder.decode(left.first(length));
      left = left.subspan(length);
    }
  } catch (const wire::WireError&) {}
  return 0;
}
