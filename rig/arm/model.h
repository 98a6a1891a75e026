// An arm as its model file describes it: Denavit–Hartenberg chain, limits, tool; forward and inverse kinematics.
//
// Joint i turns by theta_i about its z axis. `standard`: Rz(theta)·Tz(d)·Tx(a)·Rx(alpha);
// `modified` (Craig): Rx(alpha)·Tx(a)·Rz(theta)·Tz(d). Base frame as the chain begins, m and rad.
// Inverse kinematics: Newton's method on the damped least-squares inverse of the Jacobian, from where the arm
// is, so that a path stays on one branch (Orocos KDL). File keys: data/arms/*.toml.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace selvedge::arm {

struct JointLimits {
  double lower_rad = 0, upper_rad = 0;
  double speed_rad_s = 0;
  double acceleration_rad_s2 = 0;
};

class ArmModel {
 public:
  // Throws BadInput naming file and key.
  static ArmModel read(const std::filesystem::path& path);

  const std::string& name() const { return name_; }
  int joints() const { return static_cast<int>(limits_.size()); }
  const std::vector<JointLimits>& limits() const { return limits_; }
  const Eigen::VectorXd& home_rad() const { return home_rad_; }

  Eigen::Isometry3d base_from_tool(const Eigen::VectorXd& q_rad) const;
  // The joints' places from the base to the tool point, arm base frame, m: for drawing.
  std::vector<Eigen::Vector3d> link_points(const Eigen::VectorXd& q_rad) const;
  // Joint angles near `start_rad` that bring the tool to base_from_tool, to 1 µm and 1 µrad; none where that
  // is out of reach.
  std::optional<Eigen::VectorXd> inverse(const Eigen::Isometry3d& base_from_tool,
                                         const Eigen::VectorXd& start_rad) const;

 private:
  ArmModel() = default;
  struct Chain;  // KDL's
  std::string name_;
  std::shared_ptr<const Chain> chain_;
  std::vector<JointLimits> limits_;
  Eigen::VectorXd home_rad_;
};

}  // namespace selvedge::arm
