// The simulated world's fabric: a rectangular lattice of nodes, by intention unlike the fabric model that is
// fitted to it in discretisation, strain measure, damping and integrator. It shares no code with cloth/.
//
// Energy per flat area, with E the Green strain, a and b the sheet's tangents ∂x/∂u, ∂x/∂v:
//   ½ stretch (E_uu² + E_vv²) + ½ shear (a·b)² + ½ bend (|x_uu|² + |x_vv|² + 2 |x_uv|²),  E_uu = ½(|a|² − 1)
// by staggered differences of fourth order (sheet_forces.h). Damping is a dashpot behind a spring of its own, for each
// of E_uu, E_vv, a·b and the second derivatives: as viscous as the format says below some 100 Hz, and no stiffer than
// that spring above, so that it does not set the step. Drag as in the format: −(drag_normal |v_N| v_N / (1 + drag_fade
// |v_N|²) + drag_tangent v_T) per area, v relative to the air. Masses are lumped; symplectic Euler with a step below
// its stability bound. A held corner is where the plane nearest to a square of 7.5 mm of fabric there, by least
// squares, meets the corner: the same grip on every lattice. SI units. Nodes row by row from the top-left corner.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "hardware_sim/world/sheet_forces.h"
#include "hardware_sim/world/sheet_grip.h"

namespace selvedge::hardware_sim {

struct FabricTruth {
  double width_m = 0.3, height_m = 0.3;
  double density = 0.16;          // kg/m²
  double stretch = 110;           // N/m
  double shear = 55;              // N/m
  double bend = 5.5e-5;           // N·m
  double stretch_damping = 0.04;  // N·s/m
  double shear_damping = 0.04;    // N·s/m
  double bend_damping = 5e-7;     // N·m·s
  double drag_normal = 1.05;      // kg/m³
  double drag_tangent = 0.05;     // kg/(m²·s)
  double drag_fade = 0.2;         // s²/m²
};

// Of these, those of its material but density, with the exchange format's names and units; lower, upper: what a file
// may say of them.
struct FabricParameter {
  const char *name, *unit;
  double FabricTruth::*member;
  double lower, upper;
};
const std::vector<FabricParameter>& fabric_parameters();

struct LatticeOptions {
  int cells_across = 32, cells_down = 32;
  double grading = 0.4;      // by how much cells are smaller at the held corners, relative to even ones
  bool edge_held = false;    // the whole upper edge, straight between its corners, not the corners alone
  double step_share = 0.85;  // of the stability bound; a strained sheet is stiffer than it counts
  Eigen::Vector3d gravity_m_s2 = Eigen::Vector3d(0, 0, -9.81);
  Eigen::Vector3d air_m_s = Eigen::Vector3d::Zero();
};

// The lattice as an extra sees it: 3 planes each of positions, velocities and forces (gravity not among them).
struct LatticeView {
  int columns, rows;
  const SheetGrid* grid;
  double time_s;
  const FabricTruth* truth;
  const double* x[3];
  const double* v[3];
  double* f[3];
  double* mass;
  const double* area;  // m², of each node
  Eigen::Vector3d gravity_m_s2;
};

// Strains where the sheet looks at them (sheet_forces.h), and the stress in excess of the elastic, N/m, to be added to.
// E_uu: rows × (columns − 1), between two nodes of a row; E_vv: (rows − 1) × columns. Row by row.
struct StrainView {
  int columns, rows;
  const SheetGrid* grid;
  const FabricTruth* truth;
  std::vector<double> e_uu, e_vv;
  std::vector<double> stress_uu, stress_vv;
};

// Something that the fabric has beyond FabricTruth. `begin` may change masses; `add` adds forces and `stress` stresses;
// each is called once a step of dt_s, so that it may keep a memory.
class LatticeExtra {
 public:
  virtual ~LatticeExtra() = default;
  virtual void begin(const LatticeView&) {}
  virtual bool has_stress() const { return false; }
  virtual void stress(StrainView&, double /*dt_s*/) {}
  virtual void add(const LatticeView& view, double dt_s) = 0;
};

// The cubic through four nodes of a line, at a place on it: the first of them, and their weights.
struct LineCubic {
  int first;
  std::array<double, 4> weight;
};
LineCubic line_cubic(const std::vector<double>& nodes, double place);

struct LatticeEnergy {
  double stretch = 0, shear = 0, bend = 0, kinetic = 0, weight = 0;
};  // J

class LatticeSheet {
 public:
  explicit LatticeSheet(const FabricTruth& truth, const LatticeOptions& options = {});

  // Extras act in the order in which they were added. step_share: of the step that a sheet without it may take.
  void add_extra(std::shared_ptr<LatticeExtra> extra, double step_share);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  int count() const { return columns_ * rows_; }
  double largest_step_s() const { return step_s_; }

  // Along a curve between the corners as long as the edge, bulging towards `side`, straight across: nothing is
  // strained, so nothing flies off at the start.
  void hang(const Eigen::Vector3d& left, const Eigen::Vector3d& right, const Eigen::Vector3d& side);
  void set_position(const Eigen::Matrix3Xd& position);
  void set_velocity(const Eigen::Matrix3Xd& velocity);
  Eigen::Matrix3Xd position() const;
  Eigen::Matrix3Xd velocity() const;

  // Advances by duration_s in equal steps below the bound, the held corners moving linearly to where they are to be
  // at its end. brake: extra damping of every node's velocity, 1/s, to let a sheet come to rest.
  void advance(double duration_s, const Eigen::Vector3d& left_end, const Eigen::Vector3d& right_end, double brake = 0);
  // The same with nothing held.
  void advance_free(double duration_s);

  // Of nodes, 3×N, m: the point at flat coordinates uv on the surface (cubics through them), and what a grip holds.
  Eigen::Vector3d point(const Eigen::Matrix3Xd& nodes, const Eigen::Vector2d& uv) const;
  Eigen::Vector3d held_left(const Eigen::Matrix3Xd& nodes) const { return read(grips_.front(), nodes); }
  Eigen::Vector3d held_right(const Eigen::Matrix3Xd& nodes) const { return read(grips_.back(), nodes); }

  LatticeEnergy energy() const;
  double kinetic_energy() const;
  // Elastic forces and drag on each node, 3×N, N, in double precision; no damping.
  Eigen::Matrix3Xd internal_forces() const;

  // Flat coordinates of the nodes.
  std::vector<Eigen::Vector2d> rest_uv() const;

  // What a camera is to see of the surface: its nodes and the points half way between them, (2 columns − 1) a row, and
  // the triangles of these.
  Eigen::Matrix3Xd seen(const Eigen::Matrix3Xd& nodes) const;
  std::vector<std::array<int, 3>> triangles() const;

 private:
  static Eigen::Vector3d read(const SheetGrip& grip, const Eigen::Matrix3Xd& nodes);
  void hold(SheetGrip& grip);
  SheetLaw law(double dt) const;
  double stable_step_s() const;
  size_t at(int node) const { return forces_.grid().at(node / columns_, node % columns_); }
  Eigen::Matrix3Xd dense(const SheetField<float>& field) const;
  void look();
  LatticeView view();
  void act_on_stress(double dt);
  void act_on_nodes(double dt);
  SheetForces<double> exact() const;
  double largest_strain() const;
  void step(double dt, double brake, bool held);
  void steps(double duration_s, double brake, bool held);

  FabricTruth truth_;
  LatticeOptions options_;
  int columns_, rows_;
  double step_s_;
  double step_share_ = 1;                             // of all extras
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // that the forces' positions count from
  SheetForces<float> forces_;
  SheetField<float> drag_;
  SheetPlane<float> per_mass_;
  int since_drag_ = 0;
  SheetLaw law_;
  std::vector<double> mass_, area_;  // of each node; extras may add to the mass alone
  std::vector<SheetGrip> grips_;     // from left to right
  std::vector<LineCubic> seen_u_, seen_v_;
  // What extras see.
  std::vector<double> x_seen_[3], v_seen_[3], f_seen_[3];
  StrainView strains_;
  std::vector<std::shared_ptr<LatticeExtra>> extras_;
  double time_s_ = 0;
};

}  // namespace selvedge::hardware_sim
