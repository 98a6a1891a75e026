#include "station/exchange/material_export.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "cloth/material_parameters.h"
#include "files/bad_input.h"
#include "files/json_reader.h"

namespace selvedge::station {

namespace {

using nlohmann::json;

constexpr double kAir_kg_m3 = 1.2;

// Values of a fabric, and which of them a format said: the others are named.
class SaidOf {
 public:
  explicit SaidOf(const FittedFabric& fabric) : fabric_(fabric) {}

  double value(const std::string& name) {
    said_.insert(name);
    const auto found = fabric_.value.find(name);
    return found == fabric_.value.end() ? 0 : found->second;
  }
  // Seconds by which a stiffness acts on rates: a format has one for all.
  double damping_s() {
    notes.push_back(fmt::format("one damping for all: bending's, {:.3g} s; stretch has {:.3g} s, shear {:.3g} s",
                                ratio("bend_damping", "bend"), ratio("stretch_damping", "stretch"),
                                ratio("shear_damping", "shear")));
    return ratio("bend_damping", "bend");
  }
  std::vector<std::string> lines() const {
    std::vector<std::string> out = {
        fmt::format("{}, {}, {:.4g} kg/m2", fabric_.name, fabric_.source, fabric_.areal_mass)};
    out.insert(out.end(), notes.begin(), notes.end());
    const std::vector<std::string> left = unsaid();
    if (!left.empty()) out.push_back(fmt::format("this format cannot say: {}", fmt::join(left, "; ")));
    return out;
  }
  std::vector<std::string> unsaid() const {
    std::vector<std::string> left;
    for (const cloth::MaterialParameter& row : cloth::material_parameters())
      if (fabric_.value.count(row.name) && !said_.count(row.name))
        left.push_back(fmt::format("{} {:.4g} {}", row.name, fabric_.value.at(row.name), row.unit));
    return left;
  }

  std::vector<std::string> notes;  // of the conversion

 private:
  double ratio(const std::string& of, const std::string& to) {
    said_.insert(of);
    const auto a = fabric_.value.find(of), b = fabric_.value.find(to);
    return a == fabric_.value.end() || b == fabric_.value.end() ? 0 : a->second / b->second;
  }
  const FittedFabric& fabric_;
  std::set<std::string> said_;
};

std::string as_comment(const std::vector<std::string>& lines, const std::string& begin) {
  std::string text;
  for (const std::string& line : lines) text += begin + line + "\n";
  return text;
}

// Energy density ½ k0 G00² + ½ k2 G11² + ½ k3 G01² of Green's strain, k twice what the file says; a hinge of length l
// between triangles of area a together has ke l²/(2a) θ²/4.
std::string arcsim_text(SaidOf& f, double areal_mass) {
  const double stretch = f.value("stretch"), shear = f.value("shear"), bend = f.value("bend");
  const double damping_s = f.damping_s(), normal = f.value("drag_normal"), tangent = f.value("drag_tangent");
  f.notes.push_back(
      "stretching: k / 2, 0, k / 2, 2 k_shear at every strain and angle; bending: 4 B at every curvature");
  f.notes.push_back("damping belongs to the entry of `materials` in a scene, wind to the scene");
  const json row = {stretch / 2, 0.0, stretch / 2, 2 * shear}, bends = std::vector<double>(5, 4 * bend);
  const json scene = {{"materials", {{{"data", "this file"}, {"damping", damping_s}}}},
                      {"wind", {{"velocity", {0, 0, 0}}, {"density", normal}, {"drag", tangent}}}};
  return json{{"density", areal_mass},
              {"stretching", std::vector<json>(6, row)},
              {"bending", std::vector<json>(3, bends)},
              {"scene", scene},
              {"told_by_selvedge", f.lines()}}
             .dump(2) +
         "\n";
}

// ½ k |F − R|² a triangle; ½ k 3 / (A0 + A1) |Σ cot x|² a hinge, on which |Σ cot x| = l θ.
std::string diffcloth_text(SaidOf& f, double areal_mass) {
  const double stretch = f.value("stretch"), bend = f.value("bend");
  f.notes.push_back("k_stiff_stretching = k; k_stiff_bending = B / 3");
  f.notes.push_back(fmt::format("its shear stiffness is half its stretch stiffness: {:.4g} N/m", stretch / 2));
  f.notes.push_back("metres, kilograms and seconds, which a scene's lengths and gravity have to be in too");
  return as_comment(f.lines(), "// ") +
         fmt::format(".k_stiff_stretching = {:.9g},\n.k_stiff_bending = {:.9g},\n.density = {:.9g},\n", stretch,
                     bend / 3, areal_mass);
}

// A membrane of E t, and ½ xᵀ(3 µ t³ / (24 (A0 + A1)) c cᵀ)x a hinge with cᵀx = l θ: B = µ t³ / 8, µ = E / 2.
std::string mujoco_text(SaidOf& f, double areal_mass, const MaterialMesh& mesh) {
  const double stretch = f.value("stretch"), bend = f.value("bend"), damping_s = f.damping_s();
  const double thickness = 4 * std::sqrt(bend / stretch);
  constexpr int kCount = 31;
  f.notes.push_back(
      "young × thickness = k and young × thickness³ / 16 = B, at a Poisson's ratio of 0: the thickness is "
      "none that could be measured");
  f.notes.push_back(fmt::format("its shear stiffness is half its stretch stiffness: {:.4g} N/m", stretch / 2));
  f.notes.push_back(fmt::format("count and spacing are an example of {:.3g} m; mass is that of this size",
                                (kCount - 1) * mesh.spacing_m));
  const double mass = areal_mass * std::pow((kCount - 1) * mesh.spacing_m, 2);
  std::string comment = "<!--\n" + as_comment(f.lines(), "  ") + "-->\n";
  return comment + fmt::format(
                       "<flexcomp name=\"fabric\" type=\"grid\" dim=\"2\" count=\"{0} {0} 1\" "
                       "spacing=\"{1:.9g} {1:.9g} {1:.9g}\" radius=\"{2:.3g}\" mass=\"{3:.9g}\">\n"
                       "  <elasticity young=\"{4:.9g}\" poisson=\"0\" thickness=\"{5:.9g}\" "
                       "damping=\"{6:.9g}\" elastic2d=\"both\"/>\n"
                       "  <edge equality=\"false\"/>\n</flexcomp>\n",
                       kCount, mesh.spacing_m, 0.1 * mesh.spacing_m, mass, stretch / thickness, thickness, damping_s);
}

// Of a grid of square cells with sides and diagonals, N/m: what these resist by. Diagonals resist stretch too, and a
// grid whose sides are far weaker gives way at single nodes that hold it (without sides every other node is held by
// none).
struct SidesAndDiagonals {
  double sides = 0, diagonals = 0;
};
SidesAndDiagonals of_square_cells(SaidOf& f) {
  constexpr double kMostShear = 0.5;  // of stretch
  const double stretch = f.value("stretch"), shear = f.value("shear");
  const double diagonals = std::min(shear, kMostShear * stretch);
  if (diagonals < shear)
    f.notes.push_back(
        fmt::format("shear is {:.4g} N/m, of which it is told {:.4g}: diagonals that resist more than "
                    "half of the stretch leave the sides too weak to hang by",
                    shear, diagonals));
  return {stretch - diagonals, diagonals};
}

// Its unit of time is a frame, in which gravity is a thousandth of that in m/s². A side of a quad pulls with
// tension / h a metre, a diagonal with shear / h; a hinge with 0.1 b h θ, of which half at the lever h.
std::string blender_text(SaidOf& f, double areal_mass, const MaterialMesh& mesh) {
  constexpr double kFrame2 = 1e-3;
  const double h = mesh.spacing_m, bend = f.value("bend");
  const auto [sides, diagonals] = of_square_cells(f);
  f.notes.push_back(fmt::format("for a grid of quads of {:.4g} m; with another spacing all but time_scale change", h));
  f.notes.push_back(
      "tension = (k - k_shear) h / 1000, as the diagonals resist stretch too; shear = k_shear h / 1000; "
      "bending = 0.02 B / h2; mass is that of a vertex");
  f.notes.push_back("read from its source; it has no drag by the sheet's area, only air_damping a vertex, left at 0");
  return as_comment(f.lines(), "# ") +
         fmt::format(
             "import math\nimport bpy\n\n"
             "cloth = bpy.context.object.modifiers.new(\"Cloth\", \"CLOTH\").settings\n"
             "cloth.quality = 20\ncloth.bending_model = \"ANGULAR\"\n"
             "cloth.time_scale = math.sqrt(1000) / bpy.context.scene.render.fps\n"
             "cloth.mass = {:.9g}\ncloth.tension_stiffness = {:.9g}\ncloth.compression_stiffness = {:.9g}\n"
             "cloth.shear_stiffness = {:.9g}\ncloth.bending_stiffness = {:.9g}\ncloth.air_damping = 0\n"
             "cloth.tension_damping = cloth.compression_damping = cloth.shear_damping = 0\n"
             "cloth.bending_damping = 0\n",
             areal_mass * h * h, kFrame2 * sides * h, kFrame2 * sides * h, kFrame2 * diagonals * h,
             20 * kFrame2 * bend / (h * h));
}

// Of one link by itself, whose ends are corrected by the share kLST of its error in each iteration of a step.
double link_share(double stiffness_n_m, double node_mass_kg, const MaterialMesh& mesh) {
  const double left = 1 / (1 + stiffness_n_m * mesh.step_s * mesh.step_s * 2 / node_mass_kg);
  return 1 - std::pow(left, 1.0 / mesh.iterations);
}

std::string bullet_text(SaidOf& f, double areal_mass, const MaterialMesh& mesh) {
  const double h = mesh.spacing_m, node = areal_mass * h * h;
  const double normal = f.value("drag_normal");
  const auto [sides, diagonals] = of_square_cells(f);
  f.notes.push_back(
      fmt::format("its links are not springs but shares of an error put right: kLST holds for a grid of {:.4g} m, "
                  "steps of {:.4g} s, "
                  "{} iterations and a link by itself; neighbours stiffen it",
                  h, mesh.step_s, mesh.iterations));
  f.notes.push_back(
      "kDG = 2 drag_normal / air density; it pulls against the velocity, where the fabric's pulls along the normal");
  f.notes.push_back(
      "generateBendingConstraints(2) would be links across two cells, which resist a fold in the second "
      "order alone: no rigidity can be said, and none is set");
  f.notes.push_back("what solves positions damps motion by itself; kDP is left at 0");
  return as_comment(f.lines(), "// ") +
         fmt::format(
             "body->setTotalMass({:.9g} * width * height);\n"
             "sides->m_kLST = {:.9g};      // of the links along the grid\n"
             "diagonals->m_kLST = {:.9g};  // of those across its cells\n"
             "body->updateLinkConstants();\n"
             "body->m_cfg.piterations = {};\nbody->m_cfg.kDP = 0;\nbody->m_cfg.kLF = 0;\n"
             "body->m_cfg.aeromodel = btSoftBody::eAeroModel::V_TwoSidedLiftDrag;\n"
             "body->m_cfg.kDG = {:.9g};\nbody->m_worldInfo->air_density = {:.9g};\n",
             areal_mass, link_share(sides, node, mesh), link_share(diagonals, node, mesh), mesh.iterations,
             2 * normal / kAir_kg_m3, kAir_kg_m3);
}

}  // namespace

const std::vector<std::string>& material_format_names() {
  static const std::vector<std::string> names = {"arcsim", "diffcloth", "mujoco", "blender", "bullet"};
  return names;
}

FittedFabric fitted_fabric(const std::filesystem::path& fit_json) {
  const files::JsonReader fit(fit_json);
  fit.choice("format", {"fit/1"});
  if (fit.has("simulator"))
    refuse(fit.where("simulator"), "found a fit of {}, expected one of Selvedge's own sheet",
           fit.child("simulator").text("name"));
  FittedFabric out;
  const files::JsonReader fabric = fit.child("fabric"), parameters = fit.child("parameters");
  out.name = fabric.text("name");
  out.source = fmt::format("fit of {}", fit.text("campaign"));
  out.areal_mass = fabric.positive("areal_mass");
  for (const char* needed : {"stretch", "shear", "bend"})
    if (!parameters.has(needed)) refuse(parameters.where(needed), "found nothing, expected it to be fitted");
  for (const cloth::MaterialParameter& row : cloth::material_parameters())
    if (parameters.has(row.name)) out.value[row.name] = parameters.child(row.name).positive("value");
  return out;
}

std::string material_text(const FittedFabric& fabric, MaterialFormat format, const MaterialMesh& mesh) {
  SaidOf said(fabric);
  switch (format) {
    case MaterialFormat::arcsim: return arcsim_text(said, fabric.areal_mass);
    case MaterialFormat::diffcloth: return diffcloth_text(said, fabric.areal_mass);
    case MaterialFormat::mujoco: return mujoco_text(said, fabric.areal_mass, mesh);
    case MaterialFormat::blender: return blender_text(said, fabric.areal_mass, mesh);
    case MaterialFormat::bullet: return bullet_text(said, fabric.areal_mass, mesh);
  }
  return "";
}

}  // namespace selvedge::station
