// A walk that nobody walked, as BVH text: for tests, proofs and a first try. A lab's own file goes in its place.
//
// 1.7 m tall, centimetres, y up. Hips swing ±25° at 0.9 Hz, knees bend up to 50° while the leg comes forward, the
// pelvis turns ±6° and bobs 2 cm, and the body advances at 1.1 m/s.
#pragma once

#include <string>

#include "garment/wearer.h"

namespace selvedge::garment {

std::string synthetic_walk(double duration_s, double frames_per_s = 30);

// What fills its skeleton.
std::vector<Limb> walker_limbs();

}  // namespace selvedge::garment
