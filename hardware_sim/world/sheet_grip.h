// What the rig holds of a simulated sheet: sums over nodes, whatever the sheet is made of. A held corner is where the
// plane nearest to a square of fabric there, by least squares, meets the corner.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

namespace selvedge::hardware_sim {

inline constexpr double kGrip_m = 0.0075;  // side of the square

// A sum over nodes that the rig moves, and what one unit of its velocity moves each of them by.
struct SheetGrip {
  std::vector<int> node;
  std::vector<double> weight, response;
  double along = 0;  // 0: as the left corner, 1: as the right one
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();

  void set_responses(const double* mass_kg);  // one a node of the sheet
};

// Weights of all nodes of a line in the value at a place.
using ValueAt = std::function<std::vector<double>(double place_m)>;

// Nodes count row by row from the upper left corner; u from the left, the same from the right. Without responses.
SheetGrip corner_grip(const std::vector<double>& u_nodes, const ValueAt& u_value, const std::vector<double>& v_nodes,
                      const ValueAt& v_value, bool right);

}  // namespace selvedge::hardware_sim
