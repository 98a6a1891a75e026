// The world's fabric and the fabric model share no code, mesh, strain measure, bending measure or integrator; the
// parameters mean the same to both, so equal parameters must give the same motion.
#include <cmath>

#include <gtest/gtest.h>

#include "cloth/material_parameters.h"
#include "cloth/simulate.h"
#include "geometry/triangle_mesh.h"
#include "hardware_sim/world/lattice_sheet.h"
#include "hardware_sim/world/operator_hand.h"

namespace selvedge::hardware_sim {
namespace {

constexpr int kCells = 20;

double rms_mm(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return 1e3 * std::sqrt((a - b).colwise().squaredNorm().mean());
}

cloth::Material material_of(const FabricTruth& truth) {
  cloth::Material m;
  m.density = truth.density;
  for (const FabricParameter& p : fabric_parameters()) m.*cloth::material_parameter(p.name).member = truth.*p.member;
  return m;
}

// Viscous braking, then stopping the sheet at each peak of its kinetic energy.
void settle(LatticeSheet& sheet, const Eigen::Vector3d& left, const Eigen::Vector3d& right) {
  const double step = 1.0 / 120;
  for (double t = 0; t < 1.5; t += step) sheet.advance(step, left, right, 8);
  double last = 0, before = 0;
  for (double t = 0; t < 4; t += step) {
    sheet.advance(step, left, right);
    const double kinetic = sheet.energy().kinetic;
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

TEST(LatticeSheet, HangsAndWavesAsTheFabricModelDoes) {
  const FabricTruth truth;
  const Eigen::Vector3d left(-0.128, 0, 0), right(0.128, 0, 0);
  LatticeSheet lattice(truth, {.cells_across = kCells, .cells_down = kCells});
  lattice.hang(left, right, Eigen::Vector3d::UnitY());
  settle(lattice, left, right);

  HandPath hand(right, {});
  hand.wave(0.1, left, 0.05, 1.2, 0);
  const int samples = 500;
  std::vector<double> time_s;
  Eigen::Matrix3Xd left_path(3, samples), right_path(3, samples);
  for (int i = 0; i < samples; ++i) {
    time_s.push_back(i / 240.0);
    left_path.col(i) = left;
    right_path.col(i) = hand.at(time_s.back());
  }
  const cloth::Sheet sheet =
      cloth::make_sheet(geometry::make_grid_mesh(truth.width_m, truth.height_m, kCells + 1, kCells + 1));
  cloth::Experiment experiment;
  experiment.material = material_of(truth);
  experiment.path = cloth::make_path(cloth::Hold::corners, time_s, left_path, right_path);
  for (int i = 0; i <= 40; ++i) experiment.sample_s.push_back(i / 30.0);
  for (const double side : {1.0, -1.0}) {
    experiment.start_shape = cloth::hung_shape(sheet, experiment, side);
    if (experiment.start_shape.row(1).mean() > 0) break;  // the lattice's branch
  }
  const cloth::Trajectory model = cloth::simulate(sheet, {experiment}).front();
  EXPECT_LT(rms_mm(lattice.position(), model.start), 0.4);

  double square = 0, t = 0;
  for (size_t i = 0; i < model.samples.size(); ++i) {
    for (; t < experiment.sample_s[i] - 1e-9; t += 1.0 / 480) lattice.advance(1.0 / 480, left, hand.at(t + 1.0 / 480));
    square += std::pow(rms_mm(lattice.position(), model.samples[i]), 2);
  }
  EXPECT_LT(std::sqrt(square / double(model.samples.size())), 1.0);
}

}  // namespace
}  // namespace selvedge::hardware_sim
