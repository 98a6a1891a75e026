#include "cloth/spline/chosen_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "cloth/spline/settle.h"
#include "cloth/spline/simulate.h"

namespace selvedge::cloth::spline {

namespace {

constexpr double kRestChange_m = 5e-6;

double apart_m(const SplineSheet& a, const Eigen::Matrix3Xd& x, const SplineSheet& b, const Eigen::Matrix3Xd& y) {
  double sum = 0;
  for (int r = 0; r < 5; ++r)
    for (int c = 0; c < 5; ++c) {
      const Eigen::Vector2d uv((0.05 + 0.225 * c) * a.swatch.width_m, (0.05 + 0.225 * r) * a.swatch.height_m);
      sum += (position_of(surface_point(a, uv), x) - position_of(surface_point(b, uv), y)).squaredNorm();
    }
  return std::sqrt(sum / 25);
}

struct Rest {
  SplineSheet sheet;
  Grid grid;
  Settled settled;
};

Rest rest_on(const Swatch& swatch, const Experiment& e, double cell_m, const Rest* from, double side) {
  Grid grid = make_grid(swatch, e.path.hold, cell_m);
  SplineSheet sheet = make_spline_sheet(swatch, grid);
  const Eigen::Matrix3Xd start =
      from ? carried_over(from->sheet, from->settled.position, sheet) : hung_shape(sheet, e, side);
  Settled settled = settle(sheet, e, start, kRestChange_m);
  return {std::move(sheet), std::move(grid), std::move(settled)};
}

// Where the two hang in different folds, the coarser is sought once more from the finer's: a fabric may have both.
double apart_in_one_fold_m(Rest& now, const Rest& finer, const Experiment& e, double tolerance_m) {
  if (!finer.settled.at_rest) return std::numeric_limits<double>::infinity();
  const auto apart = [&](const Settled& here) {
    return here.at_rest ? apart_m(now.sheet, here.position, finer.sheet, finer.settled.position)
                        : std::numeric_limits<double>::infinity();
  };
  const double first = apart(now.settled);
  if (first <= tolerance_m) return first;
  Settled again = settle(now.sheet, e, carried_over(finer.sheet, finer.settled.position, now.sheet), kRestChange_m);
  const double second = apart(again);
  if (second >= first) return first;
  now.settled = std::move(again);
  return second;
}

}  // namespace

double bending_length_m(const Material& m, double gravity_m_s2) {
  const double bend = m.bend * std::exp(-std::abs(m.bend_anisotropy)), weight = m.density * gravity_m_s2;
  const double hard = std::cbrt(bend / weight);
  return std::cbrt(bend * std::max(0.05, 1 + m.bend_stiffening / (hard * hard)) / weight);
}

ChosenGrid choose_grid(const Swatch& swatch, const Experiment& experiment, double tolerance_m, double side) {
  ChosenGrid out;
  out.bending_length_m = bending_length_m(experiment.material, experiment.gravity_m_s2.norm());
  const double shortest = std::min(swatch.width_m, swatch.height_m) / kMostCells;
  double cell = std::max(shortest, out.bending_length_m / kCellsALength);
  Rest now = rest_on(swatch, experiment, cell, nullptr, side);
  for (;;) {
    Rest finer = rest_on(swatch, experiment, cell / std::sqrt(2.0), &now, side);
    out.left_open_m = apart_in_one_fold_m(now, finer, experiment, tolerance_m);
    out.grid = now.grid;
    out.rest = now.settled.at_rest ? now.settled.position : Eigen::Matrix3Xd();
    out.within_tolerance = out.left_open_m <= tolerance_m;
    cell /= std::sqrt(2.0);
    if (out.within_tolerance || cell < shortest) return out;
    now = std::move(finer);
  }
}

}  // namespace selvedge::cloth::spline
