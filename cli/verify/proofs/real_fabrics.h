// Fabrics drawn from measurements of real ones, which lie outside the project: ../shared/real/bending/fabrics.csv for
// mass and bending, ten fabrics of Wang, O'Brien and Ramamoorthi 2011 for stretch and shear.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cloth/material.h"

namespace selvedge::cli {

struct DrawnFabric {
  std::string name;
  cloth::Material material;
};

// Rows of fabrics.csv: areal mass (kg/m²); linear bending of warp, weft, bias (1e-9 N·m); second-order bending of the
// same (1e-12 N·m²). Throws std::runtime_error where a row is not seven numbers.
std::vector<std::vector<double>> read_fabric_rows(const std::filesystem::path& path);

// `count` fabrics, seeded; nothing where the file is not there. A row of the file gives mass and bending both ways with
// its softening, one of the ten stretch with its stiffening, shear and coupling. Losses, which nobody measured with
// these: those of cloth::Material for the membrane and the air, and bending's in proportion to its rigidity. Throws
// std::runtime_error where a row of the file is not seven numbers.
std::optional<std::vector<DrawnFabric>> draw_real_fabrics(int count, unsigned seed);

}  // namespace selvedge::cli
