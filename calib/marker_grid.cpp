#include "calib/marker_grid.h"

#include <cmath>

namespace selvedge::calib {

Eigen::Vector3d folded(const MarkerGrid& grid, double s_m, double y_m) {
  const double half = grid.fold_rad / 2;
  return {s_m * std::cos(half), y_m, -std::abs(s_m) * std::sin(half)};
}

Eigen::Vector2d flat_position(const MarkerGrid& grid, int marker) {
  const int column = marker % grid.columns, row = marker / grid.columns;
  return {(column - (grid.columns - 1) / 2.0) * grid.spacing_m, ((grid.rows - 1) / 2.0 - row) * grid.spacing_m};
}

std::vector<Eigen::Vector3d> marker_positions(const MarkerGrid& grid) {
  std::vector<Eigen::Vector3d> positions;
  for (int marker = 0; marker < grid.count(); ++marker) {
    const Eigen::Vector2d flat = flat_position(grid, marker);
    positions.push_back(folded(grid, flat.x(), flat.y()));
  }
  return positions;
}

}  // namespace selvedge::calib
