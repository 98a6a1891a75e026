// Motion captures of others as C3D files.
#include "fuzz.h"
#include "station/exchange/c3d_file.h"

using namespace selvedge;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::or_refused([&] { station::parse_c3d(fuzz::text_of(data, size), "fuzz.c3d"); });
  return 0;
}
