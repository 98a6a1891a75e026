// What a garment's file says of the body that wears it: "motion" and "limbs" (docs/garment.md).
#pragma once

#include <filesystem>

#include "garment/wearer.h"

namespace selvedge::garment {

// other_motion: a BVH file instead of the one that the garment names; empty for that one. Throws BadInput.
Wearer read_wearer(const std::filesystem::path& pattern, const std::filesystem::path& other_motion);

}  // namespace selvedge::garment
