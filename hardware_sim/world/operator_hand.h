// The simulated person at the rig: where the held corners go, and how the marker board is shown.
//
// A hand moves its corner from place to place along minimum-jerk paths of 1.5 s, and waves it on an arc of constant
// separation about the other corner, y = A (sin φ + 0.06 sin(2φ + ψ)), with φ̇ = 2πf (1 + 0.03 sin(0.7 t)), a few mm of
// vertical sway, and a ramp of one period at both ends. Board poses are drawn from a generator seeded by the
// pose's index. m, s, host clock.
#pragma once

#include <optional>

#include <Eigen/Geometry>

namespace selvedge::hardware_sim {

struct HandOptions {
  double carry_s = 1.5;   // from one place to another
  double sway_m = 0.002;  // vertical, while waving
  unsigned seed = 1;
};

// The path of one held corner, as asked for so far; times may be asked for in any order from `keep_s` ago on.
class HandPath {
 public:
  HandPath(const Eigen::Vector3d& start, const HandOptions& options) : options_(options), from_(start), to_(start) {}

  // Carries the corner to `place`, beginning at start_s from where it is then.
  void carry(double start_s, const Eigen::Vector3d& place);
  // Waves it about `pivot`, the other corner, from start_s on; duration_s 0: until carried elsewhere.
  void wave(double start_s, const Eigen::Vector3d& pivot, double amplitude_m, double frequency_hz, double duration_s);
  Eigen::Vector3d at(double host_time_s) const;
  bool still(double host_time_s) const;
  Eigen::Vector3d rest_place() const { return to_; }

 private:
  struct Wave {
    double start_s, duration_s, amplitude_m, frequency_hz;
    Eigen::Vector3d pivot;
  };
  Eigen::Vector3d waved(const Wave& wave, double t) const;

  HandOptions options_;
  Eigen::Vector3d from_, to_;
  double carry_start_s_ = -1e9;
  std::optional<Wave> wave_;
};

struct BoardPoses {
  Eigen::Vector3d centre_m = Eigen::Vector3d(0, 0, -0.15);  // of the volume in which the board is shown
  Eigen::Vector3d spread_m = Eigen::Vector3d(0.05, 0.12, 0.05);
  double yaw_rad = 0.45, pitch_rad = 0.35, roll_rad = 0.25;  // largest turns
  unsigned seed = 1;
};

// Pose number `index` of the board facing `viewer`, world from grid.
Eigen::Isometry3d board_pose(const BoardPoses& options, const Eigen::Vector3d& viewer, int index);

}  // namespace selvedge::hardware_sim
