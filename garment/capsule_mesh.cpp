#include "garment/capsule_mesh.h"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace selvedge::garment {

namespace {

constexpr int kAround = 20, kRings = 12;  // an even number of rings: half of them at each end

}  // namespace

DrawnMesh mesh_of(const std::vector<cloth::contact::Capsule>& capsules) {
  DrawnMesh mesh;
  mesh.position.resize(3, static_cast<Eigen::Index>(capsules.size()) * kRings * kAround);
  Eigen::Index at = 0;
  for (const auto& c : capsules) {
    const Eigen::Vector3d axis =
        c.to == c.from ? Eigen::Vector3d(0, 0, 1) : Eigen::Vector3d((c.to - c.from).normalized());
    const Eigen::Vector3d side = axis.unitOrthogonal(), other = axis.cross(side);
    const int first = static_cast<int>(at);
    for (int ring = 0; ring < kRings; ++ring) {
      const bool far = ring >= kRings / 2;
      const double latitude = std::numbers::pi * ((far ? ring - 1 : ring) / static_cast<double>(kRings - 2) - 0.5);
      for (int i = 0; i < kAround; ++i) {
        const double angle = 2 * std::numbers::pi * i / kAround;
        mesh.position.col(at++) =
            (far ? c.to : c.from) +
            c.radius_m *
                (std::sin(latitude) * axis + std::cos(latitude) * (std::cos(angle) * side + std::sin(angle) * other));
      }
    }
    for (int ring = 0; ring + 1 < kRings; ++ring)
      for (int i = 0; i < kAround; ++i) {
        const int a = first + ring * kAround + i, b = first + ring * kAround + (i + 1) % kAround;
        mesh.triangles.push_back({a, b, b + kAround});
        mesh.triangles.push_back({a, b + kAround, a + kAround});
      }
  }
  return mesh;
}

}  // namespace selvedge::garment
