// A spline sheet as triangles to look at: points of the surface on an even grid of the fabric.
#pragma once

#include <Eigen/Core>

#include "cloth/spline/spline_sheet.h"
#include "geometry/triangle_mesh.h"

namespace selvedge::cloth::spline {

class View {
 public:
  // points_a_cell: along each direction.
  explicit View(const SplineSheet& sheet, int points_a_cell = 2);

  const geometry::TriangleMesh& mesh() const { return mesh_; }
  // Its vertices, 3 × V, m, of control points.
  Eigen::Matrix3Xd of(const Eigen::Matrix3Xd& control) const;

 private:
  geometry::TriangleMesh mesh_;
  Eigen::MatrixXd along_u_, along_v_;  // values of the functions at the grid's points
};

}  // namespace selvedge::cloth::spline
