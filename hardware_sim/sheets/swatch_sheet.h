// A rectangular swatch in a simulated world: what a recorder of trials needs of it, whichever way it is simulated.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace selvedge::hardware_sim {

enum class SwatchHold { corners, top_edge };

struct SwatchOptions {
  SwatchHold hold = SwatchHold::corners;
  double fineness = 1;  // times as many cells each way as usual
  Eigen::Vector3d gravity_m_s2 = Eigen::Vector3d(0, 0, -9.81);
  Eigen::Vector3d air_m_s = Eigen::Vector3d::Zero();
};

// Held by its upper corners, or by its whole upper edge, straight between them. SI units; u from the left corner to the
// right one, v down.
class SwatchSheet {
 public:
  virtual ~SwatchSheet() = default;

  virtual std::vector<Eigen::Vector2d> rest_uv() const = 0;  // flat coordinates of the nodes, m
  virtual void place(const Eigen::Matrix3Xd& nodes) = 0;     // there, m, without velocity
  // The corners move linearly to where they are at the end. brake: extra damping of all velocities, 1/s.
  virtual void advance(double duration_s, const Eigen::Vector3d& left_end, const Eigen::Vector3d& right_end,
                       double brake = 0) = 0;
  virtual void stop() = 0;                    // all velocities are zero
  virtual double kinetic_energy() const = 0;  // J
  // 3 × N, m, at flat coordinates, m.
  virtual Eigen::Matrix3Xd points(const std::vector<Eigen::Vector2d>& uv) const = 0;
};

// Where a flat sheet lies that is hung unstrained along a sine between two corners that are nearer to each other than
// its width, straight down.
class HungCurve {
 public:
  HungCurve(const Eigen::Vector3d& left, const Eigen::Vector3d& right, const Eigen::Vector3d& side,
            const Eigen::Vector3d& gravity, double width_m);
  Eigen::Vector3d at(double u_m, double v_m) const;

 private:
  Eigen::Vector3d left_, span_, across_, down_;
  double width_m_, bulge_m_ = 0;
  std::vector<double> length_m_;  // of the curve up to each of its pieces' ends
};

void hang(SwatchSheet& sheet, const HungCurve& curve);
// In the shape of another sheet of that size, whatever its grid and kind.
void lie_as(SwatchSheet& sheet, const SwatchSheet& other);

// Lets a hung sheet come to rest, stopping it whenever its kinetic energy has passed a peak.
void settle(SwatchSheet& sheet, const Eigen::Vector3d& left, const Eigen::Vector3d& right);

}  // namespace selvedge::hardware_sim
