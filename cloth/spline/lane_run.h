// A group of runs of one spline sheet side by side, as the kernels take them (kernel/tables.h), and the memory of it.
#pragma once

#include <vector>

#include "cloth/simulate.h"
#include "cloth/spline/aligned.h"
#include "cloth/spline/grips.h"
#include "cloth/spline/side_arrays.h"

namespace selvedge::cloth::spline {

// What a material asks for beside even bending, mass and membrane, a bit each; what one lane asks all lanes of its run
// pay for.
int extras_of(const Material& material);

// m² of the fabric that each control point stands for.
Eigen::VectorXd areas(const SplineSheet& sheet);

// N on the control points: the experiment's smooth forces; no columns where it has none.
Eigen::Matrix3Xd smooth_forces_on(const SplineSheet& sheet, const Experiment& experiment);

// kg/m² at the control points, of fabric, hem and local weight; no air.
Eigen::VectorXd densities(const SplineSheet& sheet, const Material& material);

// Damping of bending is stiff: masses bear it (damped_inertia.h).
//
// T: float or double.
template <class T>
class LaneRun {
 public:
  // lanes: at most kernel::most_lanes<T>(). The experiments share the way of holding.
  LaneRun(const SplineSheet& sheet, const std::vector<const Experiment*>& lanes);
  LaneRun(const LaneRun&) = delete;
  LaneRun& operator=(const LaneRun&) = delete;

  bool has_memory() const { return run_.membrane_memory || run_.bend_memory; }

  void plan(double step_s, const cloth::kernel::DampingStages& stages);
  void set_position(size_t lane, const Eigen::Matrix3Xd& control) { set(x_, lane, control); }
  void set_velocity(size_t lane, const Eigen::Matrix3Xd& control) { set(v_half_, lane, control); }
  Eigen::Matrix3Xd position(size_t lane) const { return columns(x_, lane); }
  Eigen::Matrix3Xd velocity(size_t lane) const { return columns(v_half_, lane); }
  Eigen::Matrix3Xd force(size_t lane) const { return columns(force_, lane); }
  void stop();  // all lanes

  // Sets the force. memory_step_s: as cloth/kernel/force_field.h takes it.
  void set_forces(double memory_step_s);
  void push(size_t lane, int point, const Eigen::Vector3d& force_n);
  // Where the held corners are when the step begins and ends.
  void hold(size_t lane, const HeldPath& path, const Eigen::Matrix<double, 3, 2>& begin,
            const Eigen::Matrix<double, 3, 2>& end);
  // One step from the force that is set.
  void advance() { kernels_.advance(run_); }

 private:
  size_t index(size_t axis, size_t point, size_t lane) const {
    return (axis * static_cast<size_t>(sheet_.count()) + point) * width_ + lane;
  }
  Eigen::Matrix3Xd columns(const Aligned<T>& field, size_t lane) const;
  void set(Aligned<T>& field, size_t lane, const Eigen::Matrix3Xd& control);
  void fill_material(size_t lane, const Experiment& experiment);
  void fill_bend_factor(size_t lane, const Material& material);
  Inertia inertia_of(size_t lane, double step_s) const;
  void fill_air(size_t lane);
  void fill_inverses(const std::vector<Inertia>& lanes);
  void fill_grips(const std::vector<Inertia>& lanes);
  void point_at_memory();

  const SplineSheet& sheet_;
  kernel::Kernels<T> kernels_;
  size_t width_, asked_;  // lanes of a vector, and of them runs
  SideArrays<T> u_, v_;
  std::vector<Grip> grips_;
  std::vector<Material> materials_;  // one a lane
  std::vector<int> reads_start_, reads_point_, moves_start_, moves_point_;
  std::vector<T> reads_weight_, mu_, nu_, gain_;
  Aligned<T> material_, inverse_u_, inverse_v_, mass_scale_, air_share_, air_, bend_factor_, moves_weight_,
      held_position_, held_velocity_, x_, v_half_, force_, acceleration_, change_[3], scratch_, kept_, membrane_memory_,
      bend_memory_;
  kernel::Run<T> run_;
};
extern template class LaneRun<float>;
extern template class LaneRun<double>;

}  // namespace selvedge::cloth::spline
