// Fabrics, and simulating them on the spline sheet.
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "cloth/material_parameters.h"
#include "cloth/spline/chosen_grid.h"
#include "cloth/spline/simulate.h"
#include "files/bad_input.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/long_call.h"
#include "python/motion.h"

namespace selvedge::python {

namespace {

using cloth::Material;

cloth::Hold hold_named(const std::string& word) {
  static const std::pair<const char*, cloth::Hold> holds[] = {{"corners", cloth::Hold::corners},
                                                              {"top_edge", cloth::Hold::top_edge},
                                                              {"top_edge_clamped", cloth::Hold::top_edge_clamped},
                                                              {"side_edges", cloth::Hold::side_edges}};
  for (const auto& [name, hold] : holds)
    if (word == name) return hold;
  refuse("held", "found {}, expected corners, top_edge, top_edge_clamped or side_edges", in_quotes(word));
}

void bind_material(py::module_& m) {
  py::class_<Material> c(m, "Material",
                         "A fabric, per area and per width, so that nothing depends on a mesh (docs/cloth.md).");
  keyword_constructor(c);
  const std::pair<const char*, std::pair<double Material::*, const char*>> others[] = {
      {"density", {&Material::density, "kg/m^2, flat."}},
      {"stretch_anisotropy", {&Material::stretch_anisotropy, "a: stretch e^a along u, e^-a along v."}},
      {"bend_anisotropy", {&Material::bend_anisotropy, "b: bend e^b about v, e^-b about u."}},
      {"coupling", {&Material::coupling, "Poisson-like."}},
      {"stretch_stiffening",
       {&Material::stretch_stiffening, "stress = k e (1 + this |e|), or k e / (1 - this |e|) where it is negative."}},
      {"bend_stiffening", {&Material::bend_stiffening, "m^2: moment = bend k (1 + this k^2)."}},
      {"rest_curvature_u", {&Material::rest_curvature_u, "1/m."}},
      {"rest_curvature_v", {&Material::rest_curvature_v, "1/m."}},
      {"bend_friction", {&Material::bend_friction, "N."}},
      {"bend_friction_curvature", {&Material::bend_friction_curvature, "1/m."}},
      {"stretch_friction", {&Material::stretch_friction, "N/m."}},
      {"stretch_friction_strain", {&Material::stretch_friction_strain, "1."}},
      {"creep", {&Material::creep, "Share of the membrane's stiffness."}},
      {"creep_time_s", {&Material::creep_time_s, "s."}},
      {"added_mass", {&Material::added_mass, "kg/m^2, air carried along."}},
      {"hem_stiffness", {&Material::hem_stiffness, "bend (1 + this) near the rim."}},
      {"hem_density", {&Material::hem_density, "kg/m^2 more near the rim."}},
      {"hem_width_m", {&Material::hem_width_m, "m."}},
      {"local_mass_kg", {&Material::local_mass_kg, "kg, a small weight."}},
      {"local_u_m", {&Material::local_u_m, "m, where it is."}},
      {"local_v_m", {&Material::local_v_m, "m, where it is."}}};
  for (const cloth::MaterialParameter& p : cloth::material_parameters()) c.def_readwrite(p.name, p.member, p.unit);
  for (const auto& [name, member] : others) c.def_readwrite(name, member.first, member.second);
  c.def("__repr__", [](const Material& self) {
    std::string text;
    for (const cloth::MaterialParameter& p : cloth::material_parameters())
      text += fmt::format(", {}={:.4g}", p.name, self.*p.member);
    return fmt::format("Material(density={:.4g}{})", self.density, text);
  });
  c.def("__copy__", [](const Material& self) { return self; });
}

// What simulate() takes beside the fabrics.
struct Swing {
  double width_m = 0, height_m = 0;
  std::vector<double> time_s;
  PointRows left, right;
  std::string held;
  Eigen::Vector3d clamp_direction, gravity_m_s2, air_velocity_m_s;
  std::optional<std::vector<double>> sample_s;
  int side = 1, cells = 0;
};

void expect_possible(const Swing& s, const std::vector<Material>& materials) {
  if (!(s.width_m > 0)) refuse("width_m", "found {}, expected a length above 0", s.width_m);
  if (!(s.height_m > 0)) refuse("height_m", "found {}, expected a length above 0", s.height_m);
  const auto rows = static_cast<Eigen::Index>(s.time_s.size());
  if (rows < 1 || s.left.rows() != rows || s.right.rows() != rows)
    refuse("left, right", "found {} and {} points, expected one for each of {} times", s.left.rows(), s.right.rows(),
           rows);
  if (!s.left.allFinite() || !s.right.allFinite()) refuse("left, right", "found no number, expected finite points");
  for (const std::vector<double>& times : {s.time_s, s.sample_s.value_or(std::vector<double>{})})
    for (size_t i = 1; i < times.size(); ++i)
      if (!(times[i] > times[i - 1]))
        refuse("time_s, sample_s", "found {} s after {} s, expected ascending times", times[i], times[i - 1]);
  if (s.cells != 0 && (s.cells < 4 || s.cells > 64)) refuse("cells", "found {}, expected 4 to 64, or 0", s.cells);
  if (materials.empty()) refuse("material", "found an empty list, expected at least one Material");
  for (const Material& m : materials)
    for (const double positive : {m.density, m.stretch, m.shear, m.bend})
      if (!(positive > 0) || !std::isfinite(positive))
        refuse("material", "found {} for density, stretch, shear or bend, expected numbers above 0", positive);
}

// Of the softest fabric's bending length.
int cells_for(const Swing& s, const std::vector<Material>& materials) {
  if (s.cells > 0) return s.cells;
  double length_m = s.width_m;
  for (const Material& m : materials)
    length_m = std::min(length_m, cloth::spline::bending_length_m(m, s.gravity_m_s2.norm()));
  return static_cast<int>(std::clamp(std::ceil(s.width_m / length_m), 8.0, 32.0));
}

std::vector<Motion> run(const Swing& s, const std::vector<Material>& materials, const cloth::StopFlag& stop) {
  cloth::Experiment e;
  e.path = cloth::make_path(hold_named(s.held), s.time_s, s.left.transpose(), s.right.transpose());
  e.path.clamp_direction = s.clamp_direction.normalized();
  e.gravity_m_s2 = s.gravity_m_s2;
  e.air_velocity_m_s = s.air_velocity_m_s;
  e.start_s = s.time_s.front();
  e.sample_s = s.sample_s.value_or(s.time_s);
  e.stop = stop;
  const cloth::spline::Swatch swatch{s.width_m, s.height_m};
  const auto sheet = std::make_shared<const cloth::spline::SplineSheet>(
      make_spline_sheet(swatch, make_grid(swatch, e.path.hold, s.width_m / cells_for(s, materials))));
  std::vector<cloth::Experiment> lanes;
  for (const Material& m : materials) {
    lanes.push_back(e);
    lanes.back().material = m;
    lanes.back().start_shape = hung_shape(*sheet, lanes.back(), s.side);
  }
  std::vector<Motion> out;
  for (cloth::Trajectory& t : simulate(*sheet, lanes)) out.push_back({sheet, e.sample_s, std::move(t)});
  return out;
}

py::object simulate_one_or_more(const py::object& material, Swing s, const py::object& progress) {
  const bool one = py::isinstance<Material>(material);
  const auto materials = one ? std::vector{material.cast<Material>()} : material.cast<std::vector<Material>>();
  expect_possible(s, materials);
  hold_named(s.held);
  std::vector<Motion> found =
      long_call({"simulate", progress}, [&](LongCall& call) { return run(s, materials, call.stop()); });
  return one ? py::cast(std::move(found.front())) : py::cast(std::move(found));
}

void bind_simulate(py::module_& m) {
  m.def(
      "simulate",
      [](const py::object& material, double width_m, double height_m, const std::vector<double>& time_s,
         const PointRows& left, const PointRows& right, const std::string& held, const Eigen::Vector3d& clamp_direction,
         const Eigen::Vector3d& gravity_m_s2, const Eigen::Vector3d& air_velocity_m_s,
         const std::optional<std::vector<double>>& sample_s, int side, int cells, const py::object& progress) {
    return simulate_one_or_more(material,
                                {width_m, height_m, time_s, left, right, held, clamp_direction, gravity_m_s2,
                                 air_velocity_m_s, sample_s, side, cells},
                                progress);
      },
      py::arg("material"), py::kw_only(), py::arg("width_m"), py::arg("height_m"), py::arg("time_s"), py::arg("left"),
      py::arg("right"), py::arg("held") = "corners", py::arg("clamp_direction") = Eigen::Vector3d(0, 0, -1),
      py::arg("gravity_m_s2") = Eigen::Vector3d(0, 0, -9.81), py::arg("air_velocity_m_s") = Eigen::Vector3d(0, 0, 0),
      py::arg("sample_s") = py::none(), py::arg("side") = 1, py::arg("cells") = 0, py::arg("progress") = py::none(),
      "Hangs a swatch from two corners and moves them: equilibrium first, then the motion.\n\n"
      "material: a Material, or a list of them, which go side by side: then a list of motions is returned.\n"
      "time_s: (T,) s, ascending. left, right: (T, 3) m, where the held corners are; the path goes through them.\n"
      "held: corners, top_edge, top_edge_clamped (along clamp_direction) or side_edges. gravity_m_s2: (3,) m/s^2.\n"
      "air_velocity_m_s: (3,) m/s. sample_s: (S,) s, when shapes are wanted; time_s by default.\n"
      "side: +1 or -1, to which side it hangs at first. cells: of the sheet along the width (4 to 64); 0: one a\n"
      "bending length, 8 to 32. progress: None, False, or a function of the share done and what is done.");
}

void bind_motion(py::module_& m) {
  py::class_<Motion> c(m, "Motion", "A simulated motion: shapes of the whole sheet at some times.");
  c.def_property_readonly(
       "time_s", [](const Motion& self) { return array_of(self.time_s); }, "(T,), s.")
      .def_property_readonly(
          "rest_uv", [](const Motion& self) { return array_of(self.view().mesh().rest_uv); },
          "(V, 2), m: the vertices in the flat fabric, u along the top edge, v down.")
      .def_property_readonly(
          "triangles", [](const Motion& self) { return py::array(py::cast(self.triangles())); },
          "(F, 3): vertices of each triangle.")
      .def_property_readonly(
          "position", [](const Motion& self) { return self.vertices(); }, "(T, V, 3), m: the vertices at each time.")
      .def("points", &Motion::points, py::arg("uv"), "(T, N, 3), m: where points of the fabric are; uv: (N, 2), m.")
      .def_property_readonly(
          "at_rest", [](const Motion& self) { return self.trajectory.at_rest; },
          "Whether the equilibrium was found that it starts from.")
      .def_property_readonly(
          "finite", [](const Motion& self) { return self.trajectory.finite; }, "False where the motion diverged.")
      .def_property_readonly(
          "cells", [](const Motion& self) { return self.sheet->u.basis.cells(); }, "Of the sheet along its width.")
      .def("__repr__", [](const Motion& self) {
        return fmt::format("<selvedge.Motion: {} times, {} cells>", self.time_s.size(), self.sheet->u.basis.cells());
      });
}

}  // namespace

void bind_cloth(py::module_& m) {
  bind_material(m);
  bind_motion(m);
  bind_simulate(m);
}

}  // namespace selvedge::python
