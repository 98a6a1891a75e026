#include "cli/verify/proofs/real_fabrics.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

#include "hardware_sim/bank/bank_design.h"
#include "material_tests/heavy_strip.h"

namespace selvedge::cli {

namespace {

constexpr double kFar = 1.0 / 6;  // at what stretch the ten were measured last

cloth::Material fabric_of(const std::vector<double>& row, const hardware_sim::MeasuredStretch& s) {
  cloth::Material m;
  m.density = row[0];
  const double warp = 1e-9 * row[1], weft = 1e-9 * row[2];
  m.bend = std::sqrt(warp * weft);
  m.bend_anisotropy = 0.5 * std::log(warp / weft);
  const double loss = 0.5 * (row[4] / row[1] + row[5] / row[2]) * 1e-3;  // of the rigidity, per 1/m
  m.bend_stiffening = material_tests::bend_stiffening({m.bend, loss * m.bend}, 9.81 * m.density);
  m.bend_damping = cloth::Material().bend_damping / cloth::Material().bend * m.bend;
  m.stretch = std::sqrt(s.one_way * s.other_way);
  m.stretch_anisotropy = 0.5 * std::log(s.one_way / s.other_way);
  m.stretch_stiffening = std::max(0.0, std::sqrt(s.one_way_far * s.other_way_far) / m.stretch - 1) / kFar;
  m.coupling = s.coupling / m.stretch;
  m.shear = s.shear;
  return m;
}

}  // namespace

std::vector<std::vector<double>> read_fabric_rows(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(file, line);  // names
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    std::vector<double> row;
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
    if (row.size() != 7)
      throw std::runtime_error(
          fmt::format("{}, row {}: {} numbers, expected 7", path.string(), rows.size() + 2, row.size()));
    rows.push_back(std::move(row));
  }
  return rows;
}

std::optional<std::vector<DrawnFabric>> draw_real_fabrics(int count, unsigned seed) {
  const std::filesystem::path path = SELVEDGE_SOURCE_DIR "/../shared/real/bending/fabrics.csv";
  if (!std::filesystem::exists(path)) return std::nullopt;
  const auto rows = read_fabric_rows(path);
  std::mt19937 random(seed);
  std::vector<DrawnFabric> out;
  for (int k = 0; k < count; ++k) {
    const size_t row = random() % rows.size();
    const auto& ten = hardware_sim::measured_stretch();
    const hardware_sim::MeasuredStretch& stretch = ten[random() % ten.size()];
    out.push_back({fmt::format("row {} with the stretch of {}", row + 2, stretch.name), fabric_of(rows[row], stretch)});
  }
  return out;
}

}  // namespace selvedge::cli
