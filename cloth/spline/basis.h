// Cubic B-splines along one side of a swatch, on cells of any sizes.
//
// Open knots: the first and last are fourfold, so that the first and last functions alone reach the rim. cells + 3
// functions, each alive on four cells at most. Values by Cox and de Boor's recursion (The NURBS Book, eq. 2.5), slopes
// by its eq. 2.7. Lengths in m.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

namespace selvedge::cloth::spline {

inline constexpr int kDegree = 3;

// The functions alive at a point: first … first + 3.
struct Alive {
  int first = 0;
  std::array<std::array<double, 4>, 4> of{};  // [order of the derivative][function], 1/m^order
};

// Points and weights of a quadrature, m.
struct Rule {
  std::vector<double> at, weight;
};

class Basis {
 public:
  // breaks: where cells meet, from 0 to the length, ascending; at least four cells. Throws std::invalid_argument.
  explicit Basis(std::vector<double> breaks);

  int count() const { return cells() + kDegree; }
  int cells() const { return static_cast<int>(breaks_.size()) - 1; }
  double length_m() const { return breaks_.back(); }
  const std::vector<double>& breaks() const { return breaks_; }

  // Points beside the side are taken on its ends.
  Alive at(double x_m) const;

  // Where a function has its weight: Σ greville(i) N_i(x) = x.
  double greville(int i) const;

  // Gauss–Legendre of `inner` points in each cell, `rim` in the first and in the last (1 to 4).
  Rule gauss(int inner, int rim) const;

 private:
  std::vector<double> breaks_, knots_;
};

// ∫ D^order N_i D^order N_j, exact: mass (0), slope (1), bending (2) of one direction.
Eigen::MatrixXd products(const Basis& basis, int order);

// An inverse of the mass matrix that an explicit step can afford: lumped, with two corrections of Neumann's series,
//   R = (1 + E + E²) L⁻¹, E = 1 − L⁻¹ M, L the sums of M's rows.
// Symmetric, positive definite, a band of six on either side; exact for what is linear in x.
Eigen::MatrixXd corrected_inverse_mass(const Basis& basis);

}  // namespace selvedge::cloth::spline
