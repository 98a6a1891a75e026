// Garment patterns.
#include "fuzz.h"
#include "garment/pattern.h"

using namespace selvedge;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto file = fuzz::memory_folder() / "garment.json";
  fuzz::put(file, fuzz::text_of(data, size));
  fuzz::or_refused([&] { garment::read_pattern(file); });
  return 0;
}
