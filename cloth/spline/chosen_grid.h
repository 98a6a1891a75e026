// The grid that a fabric needs: no number of columns is fixed anywhere.
//
// Folds of a hanging swatch are as large as the bending length l = (B / ρ g)^⅓, B the least of the rigidities along
// warp and weft, at the curvature 1/l where they soften. The first grid has cells of kCellsALength to l. It is then
// checked: the equilibrium that it has and that of the next finer one (cells √2 smaller), sought from the same shape,
// are compared at 25 points; where they lie further apart than the tolerance, that of the coarser grid is sought once
// more in the finer's fold, and if they still do, the finer one takes its place.
#pragma once

#include "cloth/simulate.h"
#include "cloth/spline/spline_sheet.h"

namespace selvedge::cloth::spline {

inline constexpr double kCellsALength = 1;
inline constexpr int kMostCells = 64;  // a side; a grid finer than that is not tried

struct ChosenGrid {
  Grid grid;
  double bending_length_m = 0;
  double left_open_m = 0;  // rms of the 25 points between this grid and the next finer one
  bool within_tolerance = false;
  Eigen::Matrix3Xd rest;  // control points of the equilibrium on it, empty where none was found
};

// l of a material, m.
double bending_length_m(const Material& material, double gravity_m_s2 = 9.81);

// experiment: what holds the swatch, and its material. start_shape is not read: equilibria are sought from the hung
// shape bulging to side (cloth::hung_shape).
ChosenGrid choose_grid(const Swatch& swatch, const Experiment& experiment, double tolerance_m, double side = 1);

}  // namespace selvedge::cloth::spline
