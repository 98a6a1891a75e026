// The simulated world's fabric: a rectangular lattice of nodes, by intention unlike the fabric model that is
// fitted to it in mesh, strain measure, bending measure and integrator. It shares no code with cloth/.
//
// Energy per flat area, with E the Green strain, a and b the lattice's tangents ∂x/∂u, ∂x/∂v:
//   ½ stretch (E_uu² + E_vv²) + ½ shear (a·b)²,  E_uu = ½(|a|² − 1) on each lattice edge, a·b at each cell's centre
//   ½ bend (κ_u² + κ_v² + 2 |x_uv|²)
// κ_u, κ_v: curvature of the lattice lines from their turning angle φ, κ = 2 tan(φ/2)/h (Bergou et al. 2008);
// x_uv the twist of a cell. To first order these are the format's own definitions. Damping acts on the rates
// of E_uu, E_vv, a·b and of the second differences. Drag as in the format: −(drag_normal |v_N| v_N / (1 + drag_fade
// |v_N|²) + drag_tangent v_T) per area, v relative to the air. Masses are lumped; symplectic Euler with a step
// below its stability bound, and parts of it while a crease is sharp: κ has no bound where a line turns back. The two
// top corners are held, their cells as soft as a grip of 6 mm leaves them (docs/decisions/0007). SI units. Nodes row by
// row from the top-left corner.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>

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
  int cells_across = 20, cells_down = 20;
  double step_share = 0.9;  // of the stability bound; strained edges are stiffer than it counts
  Eigen::Vector3d gravity_m_s2 = Eigen::Vector3d(0, 0, -9.81);
  Eigen::Vector3d air_m_s = Eigen::Vector3d::Zero();
};

// The lattice as an extra sees it: 3 planes each of positions, velocities and forces (gravity not among them).
struct LatticeView {
  int columns, rows;
  double hu, hv, time_s;
  const FabricTruth* truth;
  const double* x[3];
  const double* v[3];
  double* f[3];
  double* mass;
  Eigen::Vector3d gravity_m_s2;
};

// Something that the fabric has beyond FabricTruth. `begin` may change masses; `add` adds forces, and is called
// once a step of dt_s, so that it may keep a memory.
class LatticeExtra {
 public:
  virtual ~LatticeExtra() = default;
  virtual void begin(const LatticeView&) {}
  virtual void add(const LatticeView& view, double dt_s) = 0;
};

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

  // Between the corners, bulging towards `side` (a direction across the sheet), at rest.
  void hang(const Eigen::Vector3d& left, const Eigen::Vector3d& right, const Eigen::Vector3d& side);
  // The same along a curve as long as the edge, straight across: nothing is strained, so nothing flies off at the
  // start.
  void hang_unstrained(const Eigen::Vector3d& left, const Eigen::Vector3d& right, const Eigen::Vector3d& side);
  void set_position(const Eigen::Matrix3Xd& position);
  void set_velocity(const Eigen::Matrix3Xd& velocity);
  Eigen::Matrix3Xd position() const;
  Eigen::Matrix3Xd velocity() const;

  // Advances by duration_s in equal steps below the bound, the corners moving linearly to where they are to be
  // at its end. brake: extra damping of every node's velocity, 1/s, to let a sheet come to rest.
  void advance(double duration_s, const Eigen::Vector3d& left_end, const Eigen::Vector3d& right_end, double brake = 0);
  // The same with nothing held.
  void advance_free(double duration_s);

  LatticeEnergy energy() const;
  // Sum of all forces on each node but gravity, 3×N, N.
  Eigen::Matrix3Xd internal_forces();

  // Flat coordinates of the nodes, and the cells' triangles.
  std::vector<Eigen::Vector2d> rest_uv() const;
  std::vector<std::array<int, 3>> triangles() const;

 private:
  using Plane = std::vector<double>;  // one coordinate of all nodes
  struct Field {
    std::array<Plane, 3> axis;
  };
  LatticeView view();
  void forces();
  void step(double dt, double brake, bool held);
  void steps(double duration_s, double brake, bool held);
  double stable_step_s(double sharpest) const;
  double sharpest_crease() const;

  FabricTruth truth_;
  LatticeOptions options_;
  int columns_, rows_;
  double hu_, hv_, step_s_;
  double step_share_ = 1;   // of all extras
  double grip_change_ = 0;  // of stretch and shear of the two held cells, relative
  Field x_, v_, f_;
  Plane mass_, area_;  // of each node; extras may add to the mass alone
  std::vector<double> scratch_;
  std::vector<std::shared_ptr<LatticeExtra>> extras_;
  double time_s_ = 0;
};

}  // namespace selvedge::hardware_sim
