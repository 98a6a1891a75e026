// A camera and a projector a metre in front of a 0.3 m sheet, as in a bench rig; and sheets to look at.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/projection.h"
#include "geometry/triangle_mesh.h"

namespace selvedge::render {

inline geometry::Projection bench_camera() {
  return geometry::looking_at({0.05, -1.0, -0.1}, {0, 0, -0.15}, 1000, 640, 480);
}
inline geometry::Projection bench_projector() {
  return geometry::looking_at({-0.1, -0.95, 0.4}, {0, 0, -0.15}, 1450, 1024, 768);
}

struct Sheet {
  Eigen::Matrix3Xd position;
  std::vector<std::array<int, 3>> triangles;
};

// 0.3 m square in the plane y = 0, its top edge at z = 0, lifted to y = bulge(x, z).
inline Sheet make_sheet(int n, const std::function<double(double, double)>& bulge) {
  Sheet sheet;
  sheet.position.resize(3, n * n);
  for (int r = 0; r < n; ++r)
    for (int c = 0; c < n; ++c) {
      const double x = 0.3 * c / (n - 1) - 0.15, z = -0.3 * r / (n - 1);
      sheet.position.col(r * n + c) = Eigen::Vector3d(x, bulge(x, z), z);
    }
  for (int r = 0; r + 1 < n; ++r)
    for (int c = 0; c + 1 < n; ++c) {
      const int i = r * n + c;
      sheet.triangles.push_back({i, i + 1, i + n});
      sheet.triangles.push_back({i + 1, i + n + 1, i + n});
    }
  return sheet;
}

}  // namespace selvedge::render
