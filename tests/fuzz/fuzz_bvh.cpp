// Recorded motions of a body: read, and posed at times before, in and after them.
#include "fuzz.h"
#include "garment/bvh.h"

using namespace selvedge;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::or_refused([&] {
    const garment::Motion motion = garment::parse_bvh(std::string(fuzz::text_of(data, size)), "fuzz.bvh");
    for (const double time_s : {-0.3, 0.0, 0.01, 1e9}) garment::pose_at(motion, time_s, 0.5);
    garment::joint_index(motion, "Hips", "fuzz.bvh");
  });
  return 0;
}
