#include "cloth/spline/chosen_grid.h"

#include <algorithm>
#include <cmath>

namespace selvedge::cloth::spline {

double bending_length_m(const Material& m, double gravity_m_s2) {
  const double bend = m.bend * std::exp(-std::abs(m.bend_anisotropy)), weight = m.density * gravity_m_s2;
  const double hard = std::cbrt(bend / weight);
  return std::cbrt(bend * std::max(0.05, 1 + m.bend_stiffening / (hard * hard)) / weight);
}

int next_finer(int cells) { return static_cast<int>(std::lround(std::sqrt(2.0) * cells)); }

ChosenGrid choose_grid(int first, int most, const std::function<double(int cells)>& moved_m) {
  ChosenGrid out{first, moved_m(first)};
  while (out.leaves_open() && next_finer(out.cells) <= most) {
    out.cells = next_finer(out.cells);
    out.finer_moves_m = moved_m(out.cells);
  }
  return out;
}

}  // namespace selvedge::cloth::spline
