// A disc of fabric round its support, as a spline surface in polar coordinates.
//
// The disc lies clamped between two plates of radius R0; the annulus from there to the rim R1 hangs. Its shape is
//   x(r, θ) = Σ N_k(r − R0) M_j(θ) c_jk,
// N cubic B-splines on cells from the plates to the rim, narrow ones first, for there fabric bends most
// (cloth/spline/basis.h), M uniform periodic ones: folds are smooth and a disc is round, so that few control points do.
// The first two rings of control points are held: fabric leaves the plates at their rim and in their plane. Warp runs
// along x, u; weft along y, v. m.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "cloth/spline/basis.h"

namespace selvedge::material_tests {

struct Disc {
  double radius_m = 0.15, support_radius_m = 0.09;
};

inline constexpr int kHeldRings = 2;

// A point of the quadrature: the 16 control points that reach it and what they weigh in the derivatives by u and v.
struct DiscPoint {
  double weight = 0;  // m²
  int first_ring = 0, first_spoke = 0;
  std::array<double, 16> u{}, v{}, uu{}, uv{}, vv{};  // [spoke 4 × ring 4]
};

class DiscSheet {
 public:
  // cells: from the support to the rim, at least four. spokes: round the disc, at least 12, a multiple of three.
  // Throws std::invalid_argument.
  DiscSheet(const Disc& disc, int cells, int spokes);

  const Disc& disc() const { return disc_; }
  int rings() const { return radial_.count(); }
  int spokes() const { return spokes_; }
  Eigen::Index count() const { return Eigen::Index(rings()) * spokes_; }
  Eigen::Index index(int spoke, int ring) const {
    return Eigen::Index((spoke % spokes_ + spokes_) % spokes_) * rings() + ring;
  }

  // Of the membrane there is one point in most cells: with as many as bending needs a coarse sheet could not bend at
  // all without stretching.
  const std::vector<DiscPoint>& membrane_points() const { return membrane_; }
  const std::vector<DiscPoint>& bending_points() const { return bending_; }
  const Eigen::VectorXd& areas() const { return areas_; }  // m², of each control point

  // Control points of a shape that is given at the places where their functions have their weight. A circle of control
  // points makes a curve of a circle's radius where they are further out by outward().
  template <class Shape>
  Eigen::Matrix3Xd control_of(const Shape& at) const {
    Eigen::Matrix3Xd control(3, count());
    for (int j = 0; j < spokes_; ++j)
      for (int k = 0; k < rings(); ++k) {
        const Eigen::Vector3d x = at(radius_of(k), angle_of(j));
        control.col(index(j, k)) = Eigen::Vector3d(outward() * x.x(), outward() * x.y(), x.z());
      }
    hold(control);
    return control;
  }
  double radius_of(int ring) const { return disc_.support_radius_m + radial_.greville(ring); }
  double angle_of(int spoke) const;
  double outward() const;

  // Puts the held rings where the plates hold them.
  void hold(Eigen::Matrix3Xd& control) const;

  // Place of a point of the fabric, r from the support's rim to the disc's.
  Eigen::Vector3d at(const Eigen::Matrix3Xd& control, double radius_m, double angle_rad) const;

  // around × along points from the support's rim to the disc's, [angle · along + radius].
  Eigen::Matrix3Xd grid(const Eigen::Matrix3Xd& control, int around, int along) const;

 private:
  std::vector<DiscPoint> points_of(const cloth::spline::Rule& along, const std::vector<double>& shares) const;
  void add_areas();

  Disc disc_;
  int spokes_;
  cloth::spline::Basis radial_;
  std::vector<DiscPoint> membrane_, bending_;
  Eigen::VectorXd areas_;
};

}  // namespace selvedge::material_tests
