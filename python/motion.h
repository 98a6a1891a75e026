// A simulated motion as Python sees it.
#pragma once

#include <memory>
#include <vector>

#include "cloth/spline/simulate.h"
#include "cloth/spline/view.h"
#include "python/arrays.h"

namespace selvedge::python {

struct Motion {
  std::shared_ptr<const cloth::spline::SplineSheet> sheet;
  std::vector<double> time_s;
  cloth::Trajectory trajectory;

  cloth::spline::View view() const { return cloth::spline::View(*sheet); }
  Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor> triangles() const;
  py::array_t<double> vertices() const;                  // (T, V, 3), m
  py::array_t<double> points(const FlatRows& uv) const;  // (T, N, 3), m
};

}  // namespace selvedge::python
