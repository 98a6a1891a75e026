// What a camera sees of the folded marker board under a projected pattern, for proofs and the simulated rig.
//
//   grey = saturate(exposure · (ambient · albedo + beacon · [disc] + lamp · albedo · blur(brightness)^γ) + noise)
//
// The board is two planes that meet at the fold; each pixel is the mean over rays of 4 × 4 places in it
// where a disc's rim crosses it and of 2 × 2 elsewhere. The projector's blur is a Gaussian across the bands.
// No shadows: the fold turns away from both devices. m, px, grey levels. Source: docs/calibration.md.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "calib/grey_image.h"
#include "calib/marker_grid.h"
#include "calib/pattern_step.h"
#include "geometry/projection.h"

namespace selvedge::hardware_sim {

// Where every ray of an image meets the board, once a pose; patterns are then cheap.
struct BoardView {
  struct Sample {
    int pixel = 0;                    // row · width + column
    float weight = 0;                 // of its pixel
    float column_px = 0, row_px = 0;  // of the projector; outside its image the lamp is dark
    float albedo = 0;
    bool disc = false;
    bool lit = false;
  };
  int width_px = 0, height_px = 0;
  std::vector<Sample> samples;
};

struct BoardLook {
  double board_albedo = 0.06;    // dark board
  double ground_albedo = 0.85;   // white ring
  double ambient_grey = 12;      // on white
  double beacon_grey = 190;      // of the retro-reflective discs, in the light beside the lens
  double lamp_grey = 170;        // on white, full brightness
  double gamma = 1;              // lamp ∝ brightness^gamma
  double projector_blur_px = 0;  // one standard deviation
  double exposure = 1;
  double noise_grey = 1;
  unsigned seed = 1;
};

// world_from_grid: the board's pose.
BoardView view_board(const calib::MarkerGrid& grid, const BoardLook& look, const Eigen::Isometry3d& world_from_grid,
                     const geometry::Projection& camera, const geometry::Projection& projector);

// beacon: the light beside the lens is on. pattern: brightness at (column, row).
calib::GreyImage shade_board(const BoardView& view, const BoardLook& look,
                             const std::function<double(double, double)>& pattern, bool beacon);

// The same with a step's own brightness, blurred by look.projector_blur_px.
calib::GreyImage shade_board(const BoardView& view, const BoardLook& look, const calib::PatternStep& step, bool beacon);

}  // namespace selvedge::hardware_sim
