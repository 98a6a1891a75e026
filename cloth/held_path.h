// How the rig holds the fabric, and where the held corners are at any time.
//
// Recorded corner positions carry sensor noise; taken as they are they would shake the sheet. A smoothing
// spline (Whittaker's: least squares plus λ times squared third differences, the weight λ by generalised
// cross-validation, hidden samples left out) gives the path at regular times, as many as there are samples;
// between them it is a natural cubic. Recorded times need not be regular: trackers report twice within a tenth
// of a millisecond, and differences over such a pair would throw the path metres off.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace selvedge::cloth {

// side_edges: the left and the right edge lie straight along clamp_direction, a sheet slung between two bars.
enum class Hold { corners, top_edge, top_edge_clamped, side_edges, nothing };

struct HeldPath {
  Hold hold = Hold::corners;
  Eigen::Vector3d clamp_direction = Eigen::Vector3d(0, 0, -1);  // unit, for top_edge_clamped and side_edges
  std::vector<double> time_s;                                   // ascending, at least one
  Eigen::Matrix3Xd left, right;                                 // at time_s, m
  Eigen::Matrix3Xd left_slope, right_slope;                     // of the interpolating cubic, m/s

  // Positions at a time; the end values outside the recording. Columns: left, right.
  Eigen::Matrix<double, 3, 2> at(double t_s) const;
  Eigen::Matrix<double, 3, 2> velocity_at(double t_s) const;
};

// A path that goes through the points given.
HeldPath make_path(Hold hold, const std::vector<double>& time_s, const Eigen::Matrix3Xd& left,
                   const Eigen::Matrix3Xd& right);

// Smooths recorded corners: NaN columns are hidden samples. still: the corners did not move, so that their
// robust mean is the path. Throws std::invalid_argument where fewer than four samples are seen of a corner.
HeldPath smooth_path(Hold hold, const std::vector<double>& time_s, const Eigen::Matrix3Xd& left,
                     const Eigen::Matrix3Xd& right, bool still);

}  // namespace selvedge::cloth
