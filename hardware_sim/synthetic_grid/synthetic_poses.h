// Poses of a made-up grid before a made-up camera and projector whose matrices are known: what the proofs
// and tests hold the solver against.
//
// The camera is 1280×1024, f = 1400 px, the projector 912×1140, f = 1500 px, both 2.2 m from a fabric volume
// of 0.5 m a side. m, px; noises are one standard deviation per axis.
// Source: the trial runs in docs/calibration.md.
#pragma once

#include <Eigen/Geometry>

#include "calib/marker_grid.h"
#include "calib/poses.h"
#include "geometry/projection.h"

namespace selvedge::hardware_sim {

struct SyntheticOptions {
  calib::MarkerGrid grid;
  int poses = 12;
  double tracker_noise_m = 0.0003;
  double camera_noise_px = 0.2;
  double projector_noise_px = 0.2;
  double swapped_share = 0;  // of the markers of each pose, camera and projector pixels passed around
  int moved_pose = -1;       // the board moves by moved_m between tracker and images
  Eigen::Vector3d moved_m = Eigen::Vector3d(0.004, 0, 0.002);
  int knocked_pose = -1;  // from this pose on the camera is turned by knocked_deg about its up axis
  double knocked_deg = 0.5;
  bool knocked_projector = false;  // the projector instead
  bool parallel_poses = false;     // one orientation, one distance
  unsigned seed = 1;
};

struct SyntheticPoses {
  calib::Poses poses;
  geometry::Projection camera, projector;  // after a knock
  std::vector<Eigen::Isometry3d> world_from_grid;
};

SyntheticPoses make_synthetic_poses(const SyntheticOptions& options);

// A device at `position` that looks at `target` with `up` upwards in its image.
geometry::Projection look_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target, const Eigen::Vector3d& up,
                             double focal_px, const calib::ImageSize& size, const std::array<double, 5>& distortion);

// A device turned about its own axes (x right, y down, z forward) by a rotation vector, its centre held.
geometry::Projection turned(const geometry::Projection& device, const Eigen::Vector3d& turn_deg);

// Root mean square per axis, over the volume's points in view of both, of the distance between what two
// projections make of a point, px.
double volume_error_px(const geometry::Projection& solved, const geometry::Projection& truth,
                       const calib::Poses& poses);

}  // namespace selvedge::hardware_sim
