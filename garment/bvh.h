// Recorded motion of a body: the BVH format of motion capture (a HIERARCHY of joints, then MOTION, one line of
// channel values a frame).
//
// Each joint's frame is placed in its parent's by its offset, its position channels (added to the offset) and
// its rotation channels, applied in the order in which the file lists them: R = R_1 R_2 R_3. Angles in degrees.
// Between frames the root moves along a cubic (Catmull–Rom) and every rotation turns evenly (slerp), so that
// playing at any rate adds no steps of its own.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace selvedge::garment {

struct Joint {
  std::string name;  // an end site is NAME-end of its parent
  int parent = -1;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // m, from the parent
  std::vector<int> channels;  // 0–2: x y z position, 3–5: x y z rotation, in the file's order
};

struct Motion {
  std::vector<Joint> joints;  // parents before children; the first is the root
  double frame_s = 0;
  // Per frame, per joint.
  std::vector<std::vector<Eigen::Vector3d>> translation;  // m, with the offset
  std::vector<std::vector<Eigen::Quaterniond>> rotation;  // parent_from_joint
  double duration_s() const { return frame_s * static_cast<double>(translation.size() - 1); }
};

struct BvhOptions {
  double metres_per_unit = 0.01;  // most files are in centimetres
  bool y_up = true;               // turned so that z is up: (x, y, z) → (x, −z, y)
};

// Throws BadInput naming the file and line of what is wrong: an unknown word, a channel that is none, a line of
// values that is too short or holds no numbers, frames that are missing, joints nested deeper than 128, and more than
// ten million poses of a joint.
Motion read_bvh(const std::filesystem::path& path, const BvhOptions& options = {});
// The same of text that was read already; `where` is for errors.
Motion parse_bvh(const std::string& text, const std::string& where, const BvhOptions& options = {});

// Throws BadInput naming the joints that there are, where `name` is none.
int joint_index(const Motion& motion, const std::string& name, const std::string& where);

// World frames of all joints at a time. Before the first frame the body comes from rest: over run_up_s the root
// gathers its speed and the limbs go from the skeleton's own pose (no rotations: as a rule standing, legs down)
// to the first frame's. After the last frame it stands.
std::vector<Eigen::Isometry3d> pose_at(const Motion& motion, double time_s, double run_up_s);

}  // namespace selvedge::garment
