// Refines one device's parameters from its sightings of the markers, with the tracker's noise in the weights.
//
//   minimise Σ ρ(rᵀ Σ⁻¹ r),  r = pixel(θ, x) − z,  Σ = s² I + σ² G Gᵀ,  G = ∂pixel/∂x
//
// σ: tracker noise (m), s: noise of the device's own pixels, estimated so that the residual is as large as
// its Σ says. Weighing by Σ is what solving for every true marker position as well would give, to first
// order. ρ is Cauchy's loss while wrong sightings may be among them, the square once they are not.
// Covariance of the parameters: (Σ Jᵀ Σ⁻¹ J)⁻¹.
//
// A device that was knocked between poses has stages: all share intrinsics and distortion, and each stage
// before the present one has its own shift. Source: B. Triggs et al., Bundle adjustment, 2000, section 3.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "calib/camera_model.h"

namespace selvedge::calib {

// One marker in one pose as one device saw it.
struct Sighting {
  int pose = 0;
  int marker = 0;
  int row = 0;            // place in Poses::rows
  Eigen::Vector3d point;  // m
  Eigen::Vector2d pixel;  // px
};

struct RefineInput {
  std::shared_ptr<const std::vector<Sighting>> sightings;
  std::vector<char> used;         // one a sighting
  std::vector<int> stage_starts;  // pose from which a stage holds, ascending; the first stage starts before all
  double tracker_noise_m = 0;
  DistortionOrder order = DistortionOrder::k1_k2_p1_p2;
};

struct Refined {
  CameraParameters camera = CameraParameters::Zero();  // in the last stage
  std::vector<PoseShift> earlier;                      // shift of stage i against the last, i before the last
  double pixel_sd_px = 0.2;                            // s
};

enum class Loss { cauchy, square };

// Stage of a pose: how many starts lie at or before it.
int stage_of(const std::vector<int>& stage_starts, int pose);

// The shift that holds for a pose; none in the last stage.
const PoseShift* shift_for(const Refined& refined, const std::vector<int>& stage_starts, int pose);

// Σ of one sighting, px².
Eigen::Matrix2d sighting_covariance(const PixelDerivatives& d, double pixel_sd_px, double tracker_noise_m);

// rᵀ Σ⁻¹ r of every sighting, used or not.
std::vector<double> whitened_squares(const Refined& refined, const RefineInput& input);

// start.earlier must have one shift a start in input.stage_starts.
Refined refine(const RefineInput& input, const Refined& start, Loss loss);

// Covariance with its sensitivity to each marker position, for what two devices have in common.
struct Uncertainty {
  Eigen::Matrix<double, kParameters, kParameters> covariance;  // zero where a parameter is held
  // Column of a sighting: how the estimate moves with its point; one a sighting, zero where unused.
  std::vector<Eigen::Matrix<double, kParameters, 3>> by_point;
  bool determined = false;  // false: some direction of the parameters is not seen at all
};
Uncertainty uncertainty(const RefineInput& input, const Refined& refined);

}  // namespace selvedge::calib
