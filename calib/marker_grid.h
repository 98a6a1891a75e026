// The physical grid: retro-reflective discs on a board folded along a vertical line, so that one pose
// already has depth.
//
// Grid frame: origin at the middle of the fold, x to the right along the board, y up along the fold, z
// towards whoever looks at it. The two halves turn back from the fold by half the fold angle each. m.
// Source: docs/calibration.md (why the board is folded).
#pragma once

#include <vector>

#include <Eigen/Core>

namespace selvedge::calib {

struct MarkerGrid {
  int columns = 6;
  int rows = 5;
  double spacing_m = 0.09;
  double fold_rad = 0.9;             // 0 is a flat board
  double disc_diameter_m = 0.016;    // reflective disc
  double ground_diameter_m = 0.044;  // matt white ring about each disc, where the projector is decoded
  double margin_m = 0.045;           // dark board beyond the outer markers

  int count() const { return columns * rows; }
};

// A point of the board from its flat position: s to the right from the fold, y up.
Eigen::Vector3d folded(const MarkerGrid& grid, double s_m, double y_m);

// Flat position (s, y) of a marker; number = row · columns + column, from the top left.
Eigen::Vector2d flat_position(const MarkerGrid& grid, int marker);

// All markers in the grid's frame.
std::vector<Eigen::Vector3d> marker_positions(const MarkerGrid& grid);

}  // namespace selvedge::calib
