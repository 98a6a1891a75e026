// The body in the garment: capsules between joints of a recorded motion.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cloth/contact/body.h"
#include "garment/bvh.h"

namespace selvedge::garment {

// A limb between two joints.
struct Limb {
  std::string from, to;
  double radius_m = 0.05;
};

struct Wearer {
  std::shared_ptr<const Motion> motion;
  std::vector<Limb> limbs;
  // Putting on: the limbs grow from a fifth of their radius over this time, while the body gathers speed; the
  // motion's own time begins at 0, after it.
  double dressing_s = 1.2;
};

// Capsules for every bone longer than 3 cm, a quarter as thick as it is long, at most 8 cm in radius: for a
// skeleton that nobody has measured.
std::vector<Limb> limbs_of_skeleton(const Motion& motion);

// where: for errors, the file that names the joints.
cloth::contact::Body body_of(const Wearer& wearer, const std::string& where);

}  // namespace selvedge::garment
