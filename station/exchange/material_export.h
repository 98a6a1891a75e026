// A fitted fabric as parameters of other simulators, with the conversion and its limits told in the file.
//
// Conversions are those of each simulator's own energies or forces on a square grid of spacing h whose cells are halved
// into right triangles, bent about a direction of the grid, small strains; there a simulator's mesh gives what our
// sheet gives, elsewhere it has stiffnesses of its own (docs/exchange.md#other-simulators). A parameter that the format
// cannot say is named in the file with its value. Sources: ARCSim's dde.cpp and physics.cpp (0.3), DiffCloth's
// Triangle.cpp and TriangleBending.h, MuJoCo's ComputeBending, Blender 3.4's SIM_mass_spring.cpp and
// implicit_blender.c, Bullet 3's btSoftBody.cpp.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace selvedge::station {

enum class MaterialFormat { arcsim, diffcloth, mujoco, blender, bullet };

// As `export --as` names them, in this order.
const std::vector<std::string>& material_format_names();

// Of the mesh and the steps that the others simulate with.
struct MaterialMesh {
  double spacing_m = 0.01;
  double step_s = 1.0 / 240;
  int iterations = 10;  // of positions, a step
};

struct FittedFabric {
  std::string name, source;             // of the fabric, and which fit
  double areal_mass = 0;                // kg/m²
  std::map<std::string, double> value;  // of each fitted parameter (cloth/material_parameters.h), in its unit
};

// Throws BadInput where the file is no fit/1 of our own sheet.
FittedFabric fitted_fabric(const std::filesystem::path& fit_json);

// The file's text.
std::string material_text(const FittedFabric& fabric, MaterialFormat format, const MaterialMesh& mesh = {});

}  // namespace selvedge::station
