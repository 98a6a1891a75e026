// Finds poses that do not belong to the same rig as the others: the board moved between the camera's look
// and the tracker's, or the device was knocked and stands elsewhere from some pose on.
//
// Both are a shift of the device's pose in a set E of poses: one pose, or all before a pose k. Around a fit
// with information A (camera), B_E (camera with shift), D_E (shift) and gradient g_E of the shift the fit
// would gain   Δχ² = g_Eᵀ (D_E − B_Eᵀ A⁻¹ B_E)⁻¹ g_E   from six more parameters (the score test).
// Poses whose sightings the fit threw out are first brought back by a robust fit of their shift alone.
// Source: C. R. Rao, Linear Statistical Inference, 6e; the change point as the largest score over k.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/refine.h"

namespace selvedge::calib {

struct PoseEvent {
  bool knocked = false;  // true: the device stood elsewhere before `pose`; false: only `pose` is off
  int pose = 0;
  double gain = 0;                      // Δχ²
  PoseShift shift = PoseShift::Zero();  // of the device, from what it is in the other poses (the present)
};

struct EventOptions {
  double least_gain = 60;       // Δχ² for six parameters; chance alone passes 60 once in 10¹⁰
  double kept_share = 0.5;      // a pose with fewer of its sightings used has been thrown out
  double agreeing_share = 0.6;  // of a thrown-out pose's sightings that one shift must explain
};

// The strongest event that the fit does not know yet, if any. Poses in `excluded` are left out.
std::optional<PoseEvent> find_event(const RefineInput& input, const Refined& refined, const std::vector<int>& excluded,
                                    const EventOptions& options);

// The shift of one pose's device under which its sightings agree with the fit, by a robust fit to them.
struct PoseFit {
  PoseShift shift = PoseShift::Zero();
  double agreeing_share = 0;  // of the pose's sightings
};
PoseFit fit_pose_shift(const RefineInput& input, const Refined& refined, int pose);

// Poses that have sightings, ascending.
std::vector<int> poses_of(const std::vector<Sighting>& sightings);

}  // namespace selvedge::calib
