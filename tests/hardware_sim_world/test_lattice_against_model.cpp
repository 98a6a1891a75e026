// The world's fabric and the fabric model share no code, mesh, strain measure or integrator; the parameters mean the
// same to both, so equal parameters must give the same motion, of a fabric as soft as real ones too.
#include <cmath>

#include <gtest/gtest.h>

#include "cloth/material_parameters.h"
#include "cloth/spline/simulate.h"
#include "hardware_sim/world/lattice_sheet.h"
#include "hardware_sim/world/operator_hand.h"

namespace selvedge::hardware_sim {
namespace {

constexpr int kCells = 28, kModelCells = 24;

double rms_mm(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return 1e3 * std::sqrt((a - b).colwise().squaredNorm().mean());
}

cloth::Material material_of(const FabricTruth& truth) {
  cloth::Material m;
  m.density = truth.density;
  for (const FabricParameter& p : fabric_parameters()) m.*cloth::material_parameter(p.name).member = truth.*p.member;
  return m;
}

// Where the 25 dots of a swatch are.
template <class At>
Eigen::Matrix3Xd dots(const FabricTruth& truth, At at) {
  Eigen::Matrix3Xd out(3, 25);
  for (int k = 0; k < 25; ++k)
    out.col(k) = at(Eigen::Vector2d(truth.width_m * (0.1 + 0.2 * (k % 5)), truth.height_m * (0.1 + 0.2 * (k / 5))));
  return out;
}

// Viscous braking, then stopping the sheet at each peak of its kinetic energy.
void settle(LatticeSheet& sheet, const Eigen::Vector3d& left, const Eigen::Vector3d& right) {
  const double step = 1.0 / 120;
  for (double t = 0; t < 1.5; t += step) sheet.advance(step, left, right, 8);
  double last = 0, before = 0;
  for (double t = 0; t < 4; t += step) {
    sheet.advance(step, left, right);
    const double kinetic = sheet.kinetic_energy();
    if (kinetic < last && last >= before) {
      sheet.set_velocity(Eigen::Matrix3Xd::Zero(3, sheet.count()));
      last = before = 0;
    } else {
      before = last;
      last = kinetic;
    }
  }
}

// Each has a table of its own; what they share are names and units.
TEST(LatticeAgainstModel, FabricParametersAreNamedAlike) {
  for (const FabricParameter& p : fabric_parameters())
    EXPECT_STREQ(cloth::material_parameter(p.name).unit, p.unit) << p.name;
}

struct Apart {
  double at_rest_mm, waved_mm;
};

// Hung with its corners `separation` apart, and one of them waved for 1.3 s.
Apart apart(const FabricTruth& truth, double separation, double amplitude) {
  const Eigen::Vector3d left(-0.128, 0, 0), right = left + separation * Eigen::Vector3d::UnitX();
  LatticeSheet lattice(truth, {.cells_across = kCells, .cells_down = kCells});
  lattice.hang(left, right, Eigen::Vector3d::UnitY());
  settle(lattice, left, right);
  const Eigen::Matrix3Xd rest = lattice.position();

  HandPath hand(right, {});
  hand.wave(0.1, left, amplitude, 0.9, 0);
  const int samples = 700;
  std::vector<double> time_s;
  Eigen::Matrix3Xd left_path(3, samples), right_path(3, samples);
  for (int i = 0; i < samples; ++i) {
    time_s.push_back(i / 480.0);
    left_path.col(i) = left;
    right_path.col(i) = hand.at(time_s.back());
  }
  namespace spline = cloth::spline;
  const spline::Swatch swatch{truth.width_m, truth.height_m};
  const spline::SplineSheet sheet =
      spline::make_spline_sheet(swatch, spline::make_grid(swatch, cloth::Hold::corners, truth.width_m / kModelCells));
  cloth::Experiment experiment;
  experiment.material = material_of(truth);
  experiment.path = cloth::make_path(cloth::Hold::corners, time_s, left_path, right_path);
  for (int i = 0; i <= 40; ++i) experiment.sample_s.push_back(i / 30.0);
  experiment.start_shape =
      spline::control_points_through(sheet, [&](const Eigen::Vector2d& uv) { return lattice.point(rest, uv); });
  const cloth::Trajectory model = spline::simulate(sheet, {experiment}).front();
  const auto of_model = [&](const Eigen::Matrix3Xd& control) {
    return dots(truth, [&](const auto& uv) { return cloth::position_of(spline::surface_point(sheet, uv), control); });
  };
  const auto of_lattice = [&] {
    const Eigen::Matrix3Xd nodes = lattice.position();
    return dots(truth, [&](const auto& uv) { return lattice.point(nodes, uv); });
  };
  EXPECT_TRUE(model.at_rest && model.finite);
  Apart out{rms_mm(of_lattice(), of_model(model.start)), 0};
  for (size_t i = 0; i < model.samples.size(); ++i) {
    for (size_t k = i == 0 ? 0 : 16 * (i - 1); k < 16 * i; ++k)
      lattice.advance(1.0 / 480, left, hand.at(static_cast<double>(k + 1) / 480));
    out.waved_mm += std::pow(rms_mm(of_lattice(), of_model(model.samples[i])), 2);
  }
  out.waved_mm = std::sqrt(out.waved_mm / static_cast<double>(model.samples.size()));
  return out;
}

TEST(LatticeSheet, HangsAndWavesAsTheFabricModelDoes) {
  const Apart stiff = apart({}, 0.256, 0.05);
  EXPECT_LT(stiff.at_rest_mm, 0.3);
  EXPECT_LT(stiff.waved_mm, 0.5);
}

TEST(LatticeSheet, OfARealFabricsSoftnessHangsAndWavesAsTheFabricModelDoes) {
  FabricTruth soft;
  soft.density = 0.197;
  soft.bend = 1.11e-5;
  soft.bend_damping = 2e-7;
  const Apart found = apart(soft, 0.285, 0.035);
  EXPECT_LT(found.at_rest_mm, 0.4);
  EXPECT_LT(found.waved_mm, 0.6);
}

}  // namespace
}  // namespace selvedge::hardware_sim
