#include "rig/arm/backends/rtde_packages.h"

using namespace selvedge;
using namespace selvedge::arm;

// The first byte is the recipe that was agreed on; the rest is the controller's byte stream.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 1) return 0;
  std::vector<uint8_t> received(data + 1, data + size);
  try {
    while (const auto package = rtde::take_package(received))
      if (package->type == rtde::data) rtde::decode_state(package->payload, data[0]);
  } catch (const wire::WireError&) {}
  return 0;
}
