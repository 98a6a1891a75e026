// Files of points of others: PLY, PCD and NPY, by the first byte.
#include "fuzz.h"
#include "station/exchange/points_file.h"

using namespace selvedge;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  constexpr const char* kKinds[] = {".ply", ".pcd", ".npy"};
  fuzz::or_refused([&] { station::parse_points(fuzz::text_of(data + 1, size - 1), kKinds[data[0] % 3], "fuzz"); });
  return 0;
}
