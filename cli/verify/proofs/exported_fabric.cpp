#include "cli/verify/proofs/exported_fabric.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "cloth/material_parameters.h"
#include "cloth/spline/chosen_grid.h"
#include "cloth/spline/simulate.h"

namespace selvedge::cli {

namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kApart = 0.85;  // of the grips, of the width
constexpr double kGrips_Hz = 480, kAsked_Hz = 120;

double number_behind(const std::string& text, const std::string& key) {
  const size_t at = text.find(key);
  if (at == std::string::npos) throw std::runtime_error(fmt::format("found no \"{}\" in an exported file", key));
  return std::stod(text.substr(at + key.size()));
}

// Of 25 points at all times of the first.
double rms_mm(const cloth::spline::SplineSheet& sheet, const std::vector<Matrix3Xd>& a,
              const std::vector<Matrix3Xd>& b) {
  constexpr int kAlong = 5;
  double squares = 0;
  for (int k = 0; k < kAlong * kAlong; ++k) {
    const cloth::SurfacePoint point =
        surface_point(sheet, kHungSide_m * Eigen::Vector2d(0.05 + 0.225 * (k % kAlong), 0.05 + 0.225 * (k / kAlong)));
    for (size_t t = 0; t < a.size(); ++t)
      squares += (position_of(point, a[t]) - position_of(point, b[t])).squaredNorm();
  }
  return 1e3 * std::sqrt(squares / (static_cast<double>(a.size()) * kAlong * kAlong));
}

}  // namespace

cloth::Material base_of(const cloth::Material& material) {
  cloth::Material base;
  base.density = material.density;
  for (const cloth::MaterialParameter& row : cloth::material_parameters()) base.*row.member = material.*row.member;
  return base;
}

station::FittedFabric fitted_as(const std::string& name, const cloth::Material& material) {
  station::FittedFabric out{name, "drawn", material.density, {}};
  for (const cloth::MaterialParameter& row : cloth::material_parameters())
    if (material.*row.member != 0) out.value[row.name] = material.*row.member;
  return out;
}

std::map<std::string, double> blender_values(const std::string& exported) {
  std::map<std::string, double> out = {{"tension_damping", number_behind(exported, "cloth.shear_damping = ")}};
  for (const char* name :
       {"tension_stiffness", "compression_stiffness", "shear_stiffness", "bending_stiffness", "air_damping"})
    out[name] = number_behind(exported, fmt::format("cloth.{} = ", name));
  return out;
}

std::map<std::string, double> bullet_values(const std::string& exported) {
  return {{"sides", number_behind(exported, "sides->m_kLST = ")},
          {"diagonals", number_behind(exported, "diagonals->m_kLST = ")},
          {"bending", 0},  // none is set
          {"damping", number_behind(exported, "m_cfg.kDP = ")},
          {"drag", number_behind(exported, "m_cfg.kDG = ")}};
}

std::string unsaid_in(const std::string& exported) {
  const std::string begin = "this format cannot say: ";
  const size_t at = exported.find(begin);
  if (at == std::string::npos) return "";
  const size_t from = at + begin.size();
  return exported.substr(from, exported.find('\n', from) - from);
}

cloth::Experiment hung_and_waved(const cloth::Material& material, double seconds) {
  const auto grips = static_cast<Index>(std::lround(seconds * kGrips_Hz)) + 1;
  const double half = 0.5 * kApart * kHungSide_m;
  std::vector<double> time_s;
  Matrix3Xd right(3, grips);
  for (Index i = 0; i < grips; ++i) {
    const double t = static_cast<double>(i) / kGrips_Hz, rise = std::min(1.0, t / 0.3);
    const double swing = 0.05 * std::sin(2 * M_PI * 1.25 * t) * rise * rise * (3 - 2 * rise);
    time_s.push_back(t);
    right.col(i) = Vector3d(half - 0.2 * std::abs(swing), 0.9 * swing, 0.3 * swing);
  }
  cloth::Experiment out;
  out.material = material;
  out.path = cloth::make_path(cloth::Hold::corners, time_s, Vector3d(-half, 0, 0).replicate(1, grips).eval(), right);
  for (int i = 0; i <= std::lround(seconds * kAsked_Hz); ++i) out.sample_s.push_back(i / kAsked_Hz);
  return out;
}

cloth::spline::SplineSheet hung_sheet(const cloth::Material& material) {
  namespace spline = cloth::spline;
  const spline::Swatch swatch{kHungSide_m, kHungSide_m};
  const auto first = static_cast<int>(std::ceil(kHungSide_m / spline::bending_length_m(material)));
  const int cells = spline::next_finer(std::max(12, first));
  return make_spline_sheet(swatch, make_grid(swatch, cloth::Hold::corners, kHungSide_m / cells));
}

HungApart apart_of(const model::Simulator& other, const cloth::spline::SplineSheet& sheet, cloth::Experiment experiment,
                   std::map<std::string, double> values) {
  constexpr double kFailed = std::numeric_limits<double>::infinity();
  experiment.simulator_values = std::move(values);
  experiment.start_shape = hung_shape(sheet, experiment, 1);
  const cloth::Trajectory there = other.simulate(sheet, {experiment}).front();
  if (!there.finite) return {kFailed, kFailed};
  experiment.start_shape = there.samples.front();
  const cloth::Trajectory here = cloth::spline::simulate(sheet, {experiment}).front();
  if (!here.finite) return {kFailed, kFailed};
  const auto all = static_cast<long>(there.samples.size());
  return {rms_mm(sheet, {there.samples.begin(), there.samples.begin() + 1}, here.samples),
          rms_mm(sheet, {there.samples.begin() + 1, there.samples.begin() + all},
                 {here.samples.begin() + 1, here.samples.begin() + all})};
}

}  // namespace selvedge::cli
