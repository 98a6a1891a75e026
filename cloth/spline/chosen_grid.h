// The grid that a fabric needs: no number of cells is fixed anywhere.
//
// Folds of a hanging swatch are as large as the bending length l = (B / ρ g)^⅓, B the least of the rigidities along
// warp and weft, at the curvature 1/l where they soften. The first grid has cells of l. It is then checked by the next
// finer one, √2 as fine: where that moves the fabric, at rest or in motion, by more than it may, the finer one takes
// its place.
#pragma once

#include <functional>

#include "cloth/material.h"

namespace selvedge::cloth::spline {

inline constexpr double kMayMove_m = 5e-4;  // root mean square, what the next finer grid may move

// l of a material, m.
double bending_length_m(const Material& material, double gravity_m_s2 = 9.81);

int next_finer(int cells);

struct ChosenGrid {
  int cells = 0;             // along the width
  double finer_moves_m = 0;  // NaN: not known
  bool leaves_open() const { return finer_moves_m > kMayMove_m; }
};

// From `first` to finer ones. moved_m(cells): by how much next_finer(cells) moves the fabric, root mean square; it is
// asked once a grid, that of the answer last. A grid of more than `most` is taken only where it is the first.
ChosenGrid choose_grid(int first, int most, const std::function<double(int cells)>& moved_m);

}  // namespace selvedge::cloth::spline
