// Whether a fabric passes through itself: pairs of its triangles that intersect, by an exact look at every pair
// whose boxes overlap. For proofs; it shares nothing with the contact that it judges but the tree of boxes, whose
// curvature criterion is off.
//
// Two triangles that do not lie in one plane intersect where an edge of one crosses the other. Edges that share a
// vertex with the other triangle are left out: neighbours touch there in any shape.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "cloth/contact/surface.h"

namespace selvedge::cloth::contact {

std::vector<std::array<int, 2>> intersecting_triangles(const Surface& surface, const Eigen::Matrix3Xd& position);

// A segment against a triangle: its ends on different sides, its way through the inside or an edge.
bool crosses(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
             const Eigen::Vector3d& c);

}  // namespace selvedge::cloth::contact
