// Forces of the simulated world's sheet on the nodes of a lattice, by staggered differences of fourth order.
//
// Nodes lie where a smooth map puts the whole numbers; along a line of them, per number and not per metre,
//   slope in the middle of a cell   (27 (x_1 − x_0) − (x_2 − x_−1)) / 24
//   value there                     (9 (x_0 + x_1) − (x_−1 + x_2)) / 16
//   derivatives at a node           (8 (x_1 − x_−1) − (x_2 − x_−2)) / 12,  (16 (x_−1 + x_1) − 30 x_0 − (x_−2 + x_2)) /
//   12
// and those of the flat coordinate by the same differences turn them into slopes and second derivatives per metre. Two
// nodes beyond each rim follow the cubic through the last four, so that the same differences hold at the rim; what
// pulls at them is handed back to those four. E_uu is looked at in the middles of sides along u, E_vv of sides along v,
// a·b and the twist at the centres of cells, the second derivatives at nodes; sums over them are integrals of fourth
// order. Forces are the exact negative slope of the energy so summed. In float and in double. SI units.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace selvedge::hardware_sim {

// One direction of the lattice.
struct SheetLine {
  std::vector<double> place;                       // flat coordinates of the nodes, ascending, m
  std::vector<double> middle_scale;                // 1/m: cells a metre, in the middle of each
  std::array<std::vector<double>, 5> second;       // 1/m²: weights of the second derivative at each node
  std::vector<double> node_weight, middle_weight;  // integrals from values at nodes and in the middles of cells, m

  SheetLine() = default;
  explicit SheetLine(std::vector<double> places);  // at least five
  int nodes() const { return static_cast<int>(place.size()); }
};

// Nodes of a side of n cells, closer together at its start, and at its end too if both: by `grading`, relative to even
// ones. m.
std::vector<double> graded_places(double length_m, int cells, double grading, bool both);

// Nodes of a plane of values and the room around them: kBorder on every side.
struct SheetGrid {
  static constexpr int kBorder = 4;
  SheetLine u, v;
  int columns = 0, rows = 0, stride = 0;

  SheetGrid() = default;
  SheetGrid(std::vector<double> along_u, std::vector<double> along_v);
  size_t at(int row, int column) const {
    return static_cast<size_t>(row + kBorder) * static_cast<size_t>(stride) + static_cast<size_t>(column + kBorder);
  }
  size_t size() const { return static_cast<size_t>(rows + 2 * kBorder) * static_cast<size_t>(stride); }
};

// Stiffness of one strain, and its dashpot behind a spring: stress = stiffness E + m, m ← keep m + gain ΔE a step.
struct StrainLaw {
  double stiffness = 0, keep = 0, gain = 0;
};

struct SheetLaw {
  StrainLaw stretch, shear, bend;
  double drag_normal = 0, drag_tangent = 0, drag_fade = 0;
  std::array<double, 3> air{};
};

template <class T>
using SheetPlane = std::vector<T>;
template <class T>
using SheetField = std::array<SheetPlane<T>, 3>;

// A strain at the points where it is looked at: now, at the step before, in its dashpot, and its stress, N/m.
template <class T>
struct StrainPlanes {
  SheetPlane<T> strain, before, lag, stress;
};

template <class T>
class SheetForces {
 public:
  SheetForces() = default;
  explicit SheetForces(const SheetGrid& grid);

  const SheetGrid& grid() const { return grid_; }
  // m, m/s: only nodes are read, and written beyond the rim. Forces are of nodes, N.
  SheetField<T> x, v, f;
  StrainPlanes<T> uu, vv, uv;  // E_uu (rows × cells), E_vv (cells × columns), a·b (cells × cells)

  // The dashpots' memory begins at the present position.
  void begin();
  // Strains and stresses of `x`; what the memory keeps is as after a step. Then what follows from stress, and bending.
  void strain(const SheetLaw& law);
  void pull(const SheetLaw& law);
  // Drag on nodes of the sheet moving with v: a field of its own, for it changes slowly.
  void drag(const SheetLaw& law, SheetField<T>& out);

  // J, of the strains last looked at and of `x`.
  struct Elastic {
    double stretch = 0, shear = 0, bend = 0;
  };
  Elastic elastic(const SheetLaw& law);

 private:
  void strain_here(const SheetLaw& law);
  void pull_here(const SheetLaw& law);
  void drag_here(const SheetLaw& law, SheetField<T>& out);

  SheetGrid grid_;
  std::array<SheetPlane<T>, 4> weights_;  // of E_uu, E_vv, of centres, of nodes, m²
  // The first three times the scale of what the strain was made from: a, b; a and b at centres.
  std::array<SheetPlane<T>, 4> pulls_;
  SheetPlane<T> scale_u_;                  // SheetLine's, with a border
  std::array<SheetPlane<T>, 5> second_u_;  // likewise
  std::vector<T> scale_v_;
  std::array<std::vector<T>, 5> second_v_;  // with a border, zero beyond the nodes
  SheetField<T> a_, b_, at_centre_a_, at_centre_b_, sa_, sb_;
  SheetField<T> lagging_, before_;  // bending's dashpots; where the sheet was
  SheetPlane<T> bent_, moment_u_, moment_v_, half_, twist_;
};

// Compiled for several processors.
template <>
void SheetForces<float>::strain(const SheetLaw&);
template <>
void SheetForces<double>::strain(const SheetLaw&);
template <>
void SheetForces<float>::pull(const SheetLaw&);
template <>
void SheetForces<double>::pull(const SheetLaw&);
template <>
void SheetForces<float>::drag(const SheetLaw&, SheetField<float>&);
template <>
void SheetForces<double>::drag(const SheetLaw&, SheetField<double>&);

extern template class SheetForces<float>;
extern template class SheetForces<double>;

}  // namespace selvedge::hardware_sim
