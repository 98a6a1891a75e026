// A swatch whose energy is a sum over points (point_fields.h): two worlds beside the lattice, from which they differ in
// discretisation, strain measure, integrator and law of the air. Shares no code with cloth/.
//
//              sliding                                    elements
//   grid       stencils of six nodes, two points a cell   elements of degree 5, their slopes kink
//   strain     |a| − 1, sine of the shear angle           ln |a|, tangent of the shear angle
//   time       leapfrog                                   Runge–Kutta of fourth order
//   air        −c |w_N| w_N / √(1 + 2 fade w_N²)          −c √(w_N² + w_T²/4) w_N / (1 + fade w_N²)
//
// Energy per flat area: ½ stretch (e_u² + e_v²) + ½ shear γ² + ½ bend (|x_uu|² + |x_vv|² + 2 |x_uv|²). Each strain has
// its dashpot behind a spring of its own (exact within a step), bending has one for every node. Nodes have the mass of
// the points that see them. A held corner is the mean of a square of 7.5 mm of fabric there, carried on to its corner
// as a plane; a held edge lies straight.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "hardware_sim/sheets/point_fields.h"
#include "hardware_sim/sheets/swatch_sheet.h"
#include "hardware_sim/world/lattice_sheet.h"

namespace selvedge::hardware_sim {

enum class PointKind { sliding, elements };

// Stresses and moments at points that a fabric has beyond FabricTruth. What it remembers is of the last `keep`; calls
// before the next begin there, since_s after it.
struct PointView {
  const PointGrid* grid;
  const FabricTruth* truth;
  double since_s;
};
class PointEffect {
 public:
  virtual ~PointEffect() = default;
  // Adds to stress of E_u and E_v, N/m.
  virtual void stress(const PointView&, PointStrain& /*along*/, PointStrain& /*down*/) {}
  virtual bool bends() const { return false; }
  // Adds to the moments, N, of the curvatures along u and down v (strain: 1/m).
  virtual void moment(const PointView&, PointStrain& /*along*/, PointStrain& /*down*/) {}
  virtual void keep() {}
};

class PointSheet : public SwatchSheet {
 public:
  PointSheet(PointKind kind, const FabricTruth& truth, const SwatchOptions& options);

  // step_share: of the step that a sheet without it may take.
  void add(std::shared_ptr<PointEffect> effect, double step_share);
  void add(std::shared_ptr<LatticeExtra> extra, double step_share);  // whose forces alone count

  std::vector<Eigen::Vector2d> rest_uv() const override;
  void place(const Eigen::Matrix3Xd& nodes) override;
  void advance(double duration_s, const Eigen::Vector3d& left_end, const Eigen::Vector3d& right_end,
               double brake = 0) override;
  void stop() override;
  double kinetic_energy() const override;
  Eigen::Matrix3Xd points(const std::vector<Eigen::Vector2d>& uv) const override;

  int count() const { return grid_.columns() * grid_.rows(); }
  const PointGrid& grid() const { return grid_; }
  double largest_step_s() const { return step_s_; }
  // N × 3 of nodes, row by row from the upper left corner, m; and elastic forces there, N.
  const Eigen::MatrixX3d& position() const { return x_; }
  void set_position(const Eigen::MatrixX3d& position);
  Eigen::MatrixX3d elastic_forces();
  double elastic_energy();  // J

 private:
  void make_grips();
  void set_responses();
  double stable_step_s();
  void elastic(const Eigen::MatrixX3d& x, double since_s, Eigen::MatrixX3d& force);
  void stress_of(PointStrain& strain, std::vector<float>& before, std::vector<float>& lag, std::vector<float>& lag_now,
                 double stiffness, double viscosity, double since_s) const;
  void add_moments();
  void keep(const Eigen::MatrixX3d& x);
  void drag(const Eigen::MatrixX3d& x, const Eigen::MatrixX3d& v);
  LatticeView view(const Eigen::MatrixX3d& x, const Eigen::MatrixX3d& v, Eigen::MatrixX3d& force);
  // Of nodes at x, v; since_s after what is remembered was kept.
  void accelerate(const Eigen::MatrixX3d& x, const Eigen::MatrixX3d& v, double since_s, double brake,
                  Eigen::MatrixX3d& out);
  void hold(Eigen::MatrixX3d& of, bool at_rest) const;
  void leap(double dt, double brake);
  void runge_kutta(double dt, double brake);

  PointKind kind_;
  FabricTruth truth_;
  SwatchOptions options_;
  PointGrid grid_;
  SheetGrid places_;  // as extras see it
  StrainMeasure measure_;
  double step_s_ = 0, step_share_ = 1, time_s_ = 0, since_kept_s_ = 0;
  Eigen::MatrixX3d x_, v_, drag_;
  Eigen::VectorXd mass_, area_;
  int since_drag_ = 0;
  PointFields at_, pulls_;
  PointStrain along_, down_, shear_;
  // Dashpots: strain when memory was last kept, what stood in them then, and now.
  std::vector<float> before_[3], lag_[3], lag_now_[3];
  Eigen::MatrixX3d bent_before_, bent_lag_, bent_lag_now_;
  std::vector<float> place_, bent_, force_;
  std::vector<SheetGrip> grips_;
  std::vector<std::shared_ptr<PointEffect>> effects_;
  std::vector<std::shared_ptr<LatticeExtra>> extras_;
};

}  // namespace selvedge::hardware_sim
