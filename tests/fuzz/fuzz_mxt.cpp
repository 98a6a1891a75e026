#include "rig/arm/backends/mxt_packet.h"
#include "rig/wire/bytes.h"

using namespace selvedge;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  for (const int joints : {6, 7}) try {
      arm::mxt::decode({data, size}, joints);
    } catch (const wire::WireError&) {}
  return 0;
}
