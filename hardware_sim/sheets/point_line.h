// One direction of a sheet whose energy is a sum over points: nodes, and what a function through them is at each point.
//
// Two kinds. Sliding stencils: the polynomial of fifth degree through the six nodes nearest to a point, two Gauss
// points a cell. Elements: the polynomial of fifth degree through an element's own six Gauss-Lobatto nodes, which are
// its points; slopes jump between elements, and these kinks bend (interior penalty, Engel et al. 2002):
//   ½ ∫ |x''|² + Σ ({x''}·[x'] + ½ η/h |[x']|²),   [·] the jump, {·} the mean, η = 2 (degree − 1)².
#pragma once

#include <vector>

namespace selvedge::hardware_sim {

// Rows of weights: out_p = Σ_k weight(p, k) in_(first(p) + k).
struct LineRows {
  int rows = 0, reach = 0;
  std::vector<int> first;
  std::vector<float> weight;  // rows × reach
};

struct PointLine {
  std::vector<double> node, node_weight;    // m, m: places, and integrals from values there
  std::vector<double> point, point_weight;  // likewise
  LineRows value, slope, second;            // at points
  LineRows node_slope;
  LineRows kink, kink_bend;          // the jumps of slopes, and the mean second derivatives there
  std::vector<double> kink_penalty;  // 1/m: η/h

  int nodes() const { return static_cast<int>(node.size()); }
  int points() const { return static_cast<int>(point.size()); }
  // Weights of all nodes in the value at a place.
  std::vector<double> value_at(double place) const;
  // Of the six nodes of its polynomial: the first, and derivatives 0 to 2 of each one's share.
  struct Stencil {
    int first = 0;
    double share[3][6] = {};
  };
  Stencil stencil_at(double place) const;

  std::vector<int> first_of_cell;  // of the polynomial between each two nodes
};

constexpr int kDegree = 5;

PointLine sliding_line(const std::vector<double>& nodes);  // at least six
PointLine element_line(const std::vector<double>& ends);   // of two elements or more

}  // namespace selvedge::hardware_sim
