// Closest points of two features and the time at which two moving ones come near.
//
// A pair holds four vertices: of kind vertex–triangle v[0] against v[1..3], of kind edge–edge v[0..1] against
// v[2..3]. Its separation is Σ w_i x_i with weights that sum to +1 on the first side and −1 on the second, so
// that both kinds are treated alike. Closest points: C. Ericson, Real-Time Collision Detection, 2005, 5.1.5
// and 5.1.9.
#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

namespace selvedge::cloth::contact {

enum class Kind : unsigned char { vertex_triangle, edge_edge };

using Four = std::array<Eigen::Vector3d, 4>;

struct Closest {
  std::array<double, 4> weight{};
  Eigen::Vector3d separation;  // m, from the second side to the first
  double distance = 0;         // m
};

Closest closest(Kind kind, const Four& position);

struct SegmentPoints {
  double first = 0, second = 0;  // parameters, 0 to 1
};
SegmentPoints closest_of_segments(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0,
                                  const Eigen::Vector3d& b1);

// The share of the displacements, 0 to 1, after which the pair has come down to (nearly) `least_m`; nothing where
// it stays above over the whole. Conservative: a step by the distance over the fastest approach never goes too
// far, so nothing is missed however the pair is degenerate (M. Li, D. M. Kaufman & C. Jiang, Codimensional
// incremental potential contact, ACM TOG 40(4), 2021, section 5: additive continuous collision detection).
// distance_m: at the start; least_m must lie below it.
std::optional<double> time_of_approach(Kind kind, const Four& start, const Four& displacement, double distance_m,
                                       double least_m);

}  // namespace selvedge::cloth::contact
