// The stiffness of a spline sheet at a shape: minus the slope of its forces by its control points.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "cloth/spline/energy.h"
#include "cloth/spline/spline_sheet.h"
#include "cloth/stiffness.h"

namespace selvedge::cloth::spline {

// What is left out so that it stays positive: nothing; or what compression, shear and softening take from it.
enum class Convexity { as_it_is, kept_positive };

// Symmetric, in 3 × 3 blocks of pairs of control points that lie no more than three rows and columns apart.
class Tangent {
 public:
  explicit Tangent(const SplineSheet& sheet);

  // Of membrane and bending with its softening and its hem; friction, creep and rest curvature are left out. Where
  // bending is anisotropic and softens, the symmetric part.
  void set(const Material& material, const Eigen::Matrix3Xd& control, Convexity convexity);

  // i ≥ j, of a pair within reach.
  Eigen::Matrix3d& at(int i, int j) { return block_[where(i, j)]; }
  const Eigen::Matrix3d& at(int i, int j) const { return block_[where(i, j)]; }

  // 3N × 3N, number 3 i + axis.
  StiffnessMatrix matrix() const;

 private:
  size_t where(int i, int j) const {
    const int n = columns_, down = i / n - j / n, along = i % n - j % n + 3;
    return static_cast<size_t>(i * 28 + down * 7 + along);
  }
  void add_membrane(const Material& material, const Eigen::Matrix3Xd& control, Convexity convexity);
  void add_even_bending(const Material& material);
  void add_other_bending(const Material& material, const Eigen::Matrix3Xd& control, Convexity convexity);

  const SplineSheet& sheet_;
  int columns_;
  BendMatrices bend_;
  std::vector<Eigen::Matrix3d> block_;
};

}  // namespace selvedge::cloth::spline
