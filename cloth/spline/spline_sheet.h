// A rectangular swatch as one smooth surface: a tensor product of cubic B-splines over its flat state.
//
// Control point (column c along u, row r down v) is column r · columns + c of a 3 × N matrix, m. Membrane and drag are
// looked at in few points (one in a cell, three a direction in the cells of the rim): with more, folds lock
// (Adam et al. 2015; docs/decisions/0023-spline-sheet.md). Bending of even rigidity is exact.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "cloth/held_path.h"
#include "cloth/spline/basis.h"
#include "cloth/surface_point.h"

namespace selvedge::cloth::spline {

// A swatch with the size of what holds its corners.
struct Swatch {
  double width_m = 0.3, height_m = 0.3;
  double grip_m = 0.0075;  // side of the square at a held corner whose plane the rig moves
};

// Where the cells of the two directions meet, m.
struct Grid {
  std::vector<double> u, v;
};

// Cells about as large as cell_m; rim_share: of a cell next to the held rim (Hold) to the largest, 1: all alike.
Grid make_grid(const Swatch& swatch, Hold hold, double cell_m, double rim_share = 1);

// One direction, with all that forces need of it.
struct Side {
  Basis basis;
  Rule rule;
  std::vector<Alive> alive;                    // one a point of the rule
  Eigen::MatrixXd mass, slope, bend, inverse;  // basis.h
};

struct SplineSheet {
  Swatch swatch;
  Side u, v;
  double bend_omega2 = 0;  // m⁻⁴: largest of bending of rigidity 1 over mass 1

  int columns() const { return u.basis.count(); }
  int rows() const { return v.basis.count(); }
  int count() const { return columns() * rows(); }
  int index(int column, int row) const { return row * columns() + column; }
};

SplineSheet make_spline_sheet(const Swatch& swatch, const Grid& grid);

// A point of the surface as a sum over control points.
SurfacePoint surface_point(const SplineSheet& sheet, const Eigen::Vector2d& uv);

// How far a point of the swatch lies from its rim, m.
double rim_distance(const Swatch& swatch, const Eigen::Vector2d& uv);

// Where the control points have their weight on the flat swatch.
std::vector<Eigen::Vector2d> greville_points(const SplineSheet& sheet);

// Control points of the surface that passes through shape(uv) at all greville_points.
Eigen::Matrix3Xd control_points_through(const SplineSheet& sheet,
                                        const std::function<Eigen::Vector3d(const Eigen::Vector2d&)>& shape);

// The surface of one grid on another.
Eigen::Matrix3Xd carried_over(const SplineSheet& from, const Eigen::Matrix3Xd& control, const SplineSheet& to);

}  // namespace selvedge::cloth::spline
