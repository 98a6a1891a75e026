#include "garment/wearer.h"

#include <algorithm>

namespace selvedge::garment {

std::vector<Limb> limbs_of_skeleton(const Motion& motion) {
  std::vector<Limb> limbs;
  for (const Joint& joint : motion.joints) {
    const double length = joint.offset.norm();
    if (joint.parent < 0 || length < 0.03) continue;
    limbs.push_back({motion.joints[static_cast<size_t>(joint.parent)].name, joint.name, std::min(0.25 * length, 0.08)});
  }
  return limbs;
}

cloth::contact::Body body_of(const Wearer& wearer, const std::string& where) {
  struct Bone {
    size_t from, to;
    double radius_m;
  };
  std::vector<Bone> bones;
  for (const Limb& limb : wearer.limbs)
    bones.push_back({static_cast<size_t>(joint_index(*wearer.motion, limb.from, where)),
                     static_cast<size_t>(joint_index(*wearer.motion, limb.to, where)), limb.radius_m});
  cloth::contact::Body body;
  body.capsules_at = [bones, motion = wearer.motion, dressing_s = wearer.dressing_s](double time_s) {
    const std::vector<Eigen::Isometry3d> pose = pose_at(*motion, time_s, dressing_s);
    // Full size a little before the motion starts.
    const double x = dressing_s > 0 ? std::clamp((time_s + dressing_s) / (0.7 * dressing_s), 0.0, 1.0) : 1;
    const double grown = 0.2 + 0.8 * x * x * (3 - 2 * x);
    std::vector<cloth::contact::Capsule> capsules;
    for (const Bone& bone : bones)
      capsules.push_back({pose[bone.from].translation(), pose[bone.to].translation(), grown * bone.radius_m});
    return capsules;
  };
  return body;
}

}  // namespace selvedge::garment
