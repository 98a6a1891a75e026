#include "python/motion.h"

#include <algorithm>

#include "files/bad_input.h"

namespace selvedge::python {

namespace {

// shape_of(sample): 3×count.
template <class Shape>
py::array_t<double> stacked(const cloth::Trajectory& trajectory, Eigen::Index count, const Shape& shape_of) {
  py::array_t<double> out(
      {static_cast<py::ssize_t>(trajectory.samples.size()), static_cast<py::ssize_t>(count), py::ssize_t{3}});
  double* to = out.mutable_data();
  for (const Eigen::Matrix3Xd& sample : trajectory.samples) {
    const Eigen::Matrix3Xd shape = shape_of(sample);
    to = std::copy(shape.data(), shape.data() + shape.size(), to);
  }
  return out;
}

}  // namespace

Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor> Motion::triangles() const {
  const cloth::spline::View shown = view();
  Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor> out(static_cast<Eigen::Index>(shown.mesh().triangles.size()),
                                                             3);
  for (Eigen::Index i = 0; i < out.rows(); ++i)
    for (Eigen::Index k = 0; k < 3; ++k)
      out(i, k) = shown.mesh().triangles[static_cast<size_t>(i)][static_cast<size_t>(k)];
  return out;
}

py::array_t<double> Motion::vertices() const {
  const cloth::spline::View shown = view();
  return stacked(trajectory, static_cast<Eigen::Index>(shown.mesh().rest_uv.size()),
                 [&](const Eigen::Matrix3Xd& sample) { return shown.of(sample); });
}

py::array_t<double> Motion::points(const FlatRows& uv) const {
  if (!uv.allFinite()) refuse("uv", "found no number, expected points of the fabric, m");
  std::vector<cloth::SurfacePoint> points;
  for (Eigen::Index i = 0; i < uv.rows(); ++i) points.push_back(surface_point(*sheet, uv.row(i).transpose()));
  return stacked(trajectory, uv.rows(), [&](const Eigen::Matrix3Xd& sample) {
    Eigen::Matrix3Xd shape(3, uv.rows());
    for (Eigen::Index i = 0; i < uv.rows(); ++i) shape.col(i) = position_of(points[static_cast<size_t>(i)], sample);
    return shape;
  });
}

}  // namespace selvedge::python
