// Provot's mass–spring sheet (Provot 1995) as Louchet, Provot & Crochemore 1995 use and identify it.
//
// A grid of equal masses; springs of six kinds join each to its neighbours:
//   0, 1 structural  [i,j]–[i+1,j], [i,j]–[i,j+1]
//   2, 3 shear       [i,j]–[i+1,j+1], [i+1,j]–[i,j+1]
//   4, 5 flexion     [i,j]–[i+2,j], [i,j]–[i,j+2]
// Force of a spring on its first end: K (L − l⁰ L/|L|), L from the first end to the second. Besides act
// gravity, viscous damping −C v, and a flow: C_f [n·(u − v)] n with the unit normal n.
// Euler step as they write it: v += Δt F/μ, P += Δt v. Then, in one pass over all springs, each whose
// elongation |L|/l⁰ − 1 exceeds its critical rate τ is shortened to exactly τ, both ends by half or the free
// end alone (inverse dynamics); the velocity becomes the displacement over Δt.
#pragma once

#include <array>
#include <vector>

#include "cloth/state.h"

namespace selvedge::experiments {

struct SpringKind {
  double length_m = 0;  // natural
  double stiffness_n_m = 0;
  double critical_elongation = 0;  // τ
};

// All 18 parameters of a homogeneous fabric, in the paper's order of kinds.
using ProvotFabric = std::array<SpringKind, 6>;

// The paper's isotropic fabric of five parameters; the defaults are its reference.
struct IsotropicFabric {
  double structural_m = 0.09375, shear_m = 0.132583, flexion_m = 0.1875;
  double stiffness_n_m = 4;
  double critical_elongation = 0.5;
};
ProvotFabric fabric_of(const IsotropicFabric& isotropic);

// What is not identified: mesh, mass, surroundings, step. The paper gives no numbers for the last three; with
// these many springs of the hanging sheet reach τ = 0.5, as it says they do.
struct ProvotScene {
  int columns = 17, rows = 17;
  double spacing_m = 0.09375;    // of the flat start
  double mass_kg = 1.5e-3;       // of one point
  double damping_kg_s = 2.5e-3;  // C
  double flow_kg_s = 0;          // C_f
  Eigen::Vector3d flow_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d gravity_m_s2 = Eigen::Vector3d(0, 0, -9.81);
  double step_s = 4e-3;
  std::vector<int> held;  // points that never move; point (column i, row j) is j·columns + i
};

// Level and at rest in the plane z = 0, held by the two corners of row 0 if scene.held is empty.
cloth::State level_start(const ProvotScene& scene);
std::vector<int> held_points(const ProvotScene& scene);

// A mesh made ready to step.
class ProvotSheet {
 public:
  explicit ProvotSheet(const ProvotScene& scene);

  struct Spring {
    int first, second, kind;
  };
  const std::vector<Spring>& springs() const { return springs_; }

  // N, of the springs and the surroundings.
  Eigen::Matrix3Xd forces(const ProvotFabric& fabric, const cloth::State& state) const;

  // One time step.
  void advance(const ProvotFabric& fabric, cloth::State& state) const;

  // The states after each of `steps` steps.
  std::vector<cloth::State> run(const ProvotFabric& fabric, const cloth::State& start, int steps) const;

 private:
  void shorten(const ProvotFabric& fabric, Eigen::Matrix3Xd& position) const;

  ProvotScene scene_;
  std::vector<Spring> springs_;
  std::vector<char> is_held_;
};

}  // namespace selvedge::experiments
