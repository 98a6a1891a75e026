// Arrays between numpy and Eigen. Points are N×3 there and 3×N here, flat points N×2 and lists of vectors. What Python
// reads of a trial is a copy and says so: it is read-only. To change it, assign a whole array.
#pragma once

#include <string>
#include <vector>

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

namespace selvedge::python {

namespace py = pybind11;

using PointRows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using FlatRows = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;

inline py::array read_only(py::array array) {
  array.attr("flags").attr("writeable") = false;
  return array;
}

template <class T>
py::array_t<T> array_of(const std::vector<T>& values) {
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

inline py::array array_of(const Eigen::Matrix3Xd& points) {
  return py::cast(PointRows(points.transpose()), py::return_value_policy::move);
}

inline py::array array_of(const std::vector<Eigen::Vector2d>& points) {
  FlatRows rows(static_cast<Eigen::Index>(points.size()), 2);
  for (size_t i = 0; i < points.size(); ++i) rows.row(static_cast<Eigen::Index>(i)) = points[i];
  return py::cast(rows, py::return_value_policy::move);
}

inline void assign(Eigen::Matrix3Xd& to, const PointRows& rows) { to = rows.transpose(); }

template <class T>
void assign(std::vector<T>& to, const std::vector<T>& values) {
  to = values;
}

inline void assign(std::vector<Eigen::Vector2d>& to, const FlatRows& rows) {
  to.clear();
  for (Eigen::Index i = 0; i < rows.rows(); ++i) to.push_back(rows.row(i));
}

// An attribute that is an array: `Given` is what may be assigned.
template <class Given, class Class, class Member>
void array_part(py::class_<Class>& c, const char* name, Member Class::*member, const char* doc) {
  c.def_property(
      name, [member](const Class& self) { return read_only(array_of(self.*member)); },
      [member](Class& self, const Given& given) { assign(self.*member, given); }, doc);
}

// An attribute that may be None, and is a part of its owner where it is there.
template <class Class, class Part>
void optional_part(py::class_<Class>& c, const char* name, std::optional<Part> Class::*member, const char* doc) {
  c.def_property(
      name, [member](Class& self) { return self.*member ? &*(self.*member) : nullptr; },
      [member](Class& self, std::optional<Part> part) { self.*member = std::move(part); }, doc);
}

// A constructor whose keywords are attributes.
template <class Class>
void keyword_constructor(py::class_<Class>& c) {
  c.def(py::init([](const py::kwargs& keywords) {
          const py::object made = py::cast(Class{});
          for (const auto& [name, value] : keywords) py::setattr(made, name, value);
          return made.cast<Class>();
        }),
        "Keywords are attributes.");
}

}  // namespace selvedge::python
