// A knitted skirt on the synthetic walk, for `prove contact` and `bench contact`.
#pragma once

#include "garment/wear.h"

namespace selvedge::cli {

struct WornSkirt {
  int triangles = 0;
  garment::Worn worn;
};

// About as many triangles as asked for.
WornSkirt wear_walking_skirt(int triangles, double duration_s, const report::ProgressCallback& progress);

}  // namespace selvedge::cli
