// make_irregular_mesh: vertices of a turned, jittered triangular lattice, joined by Bowyer and Watson's
// incremental Delaunay triangulation (A. Bowyer, D. F. Watson, Computer Journal 24, 1981). Points are added
// from left to right, so that triangles whose circumcircle lies behind the sweep are finished.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <stdexcept>

#include "geometry/plane.h"
#include "geometry/triangle_mesh.h"

namespace selvedge::geometry {

namespace {

struct Open {
  std::array<int, 3> vertices;
  Eigen::Vector2d centre;
  double squared_radius;
};

Open with_circumcircle(const std::array<int, 3>& vertices, const std::vector<Eigen::Vector2d>& points) {
  const Eigen::Vector2d a = points[vertices[0]];
  const Eigen::Vector2d b = points[vertices[1]] - a, c = points[vertices[2]] - a;
  const double d = 2 * cross(b, c);
  const Eigen::Vector2d offset((c.y() * b.squaredNorm() - b.y() * c.squaredNorm()) / d,
                               (b.x() * c.squaredNorm() - c.x() * b.squaredNorm()) / d);
  return {vertices, a + offset, offset.squaredNorm()};
}

using Edge = std::array<int, 2>;

// Takes out of `open` the triangles whose circumcircle holds the point; returns the cavity's outline.
std::vector<Edge> carve_cavity(std::vector<Open>& open, const Eigen::Vector2d& point) {
  std::vector<Edge> edges;
  std::erase_if(open, [&](const Open& triangle) {
    if ((point - triangle.centre).squaredNorm() >= triangle.squared_radius) return false;
    for (int i = 0; i < 3; ++i) edges.push_back({triangle.vertices[i], triangle.vertices[(i + 1) % 3]});
    return true;
  });
  std::vector<Edge> outline;
  for (const Edge& edge : edges)
    if (std::find(edges.begin(), edges.end(), Edge{edge[1], edge[0]}) == edges.end()) outline.push_back(edge);
  return outline;
}

// The flat positions with each side of the outline bulged outwards by a thousandth: no three points of it
// lie on a line then, and the convex hull is the outline.
std::vector<Eigen::Vector2d> bulged(const TriangleMesh& mesh) {
  const double bulge_m = 1e-3 * std::max(mesh.width_m, mesh.height_m);
  std::vector<Eigen::Vector2d> points = mesh.rest_uv;
  for (Eigen::Vector2d& point : points) {
    const double s = point.x() / mesh.width_m, t = point.y() / mesh.height_m;
    if (s == 0 || s == 1) point.x() += (2 * s - 1) * bulge_m * 4 * t * (1 - t);
    if (t == 0 || t == 1) point.y() += (2 * t - 1) * bulge_m * 4 * s * (1 - s);
  }
  return points;
}

// points: no three on a line. Triangles turn as the enclosing one does: from u to v.
std::vector<std::array<int, 3>> triangulate(std::vector<Eigen::Vector2d> points, double extent_m) {
  const int count = static_cast<int>(points.size());
  std::vector<int> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return points[a].x() != points[b].x() ? points[a].x() < points[b].x() : points[a].y() < points[b].y();
  });
  // Far enough that its corners lie in no circumcircle of the fabric's own triangles.
  const double far = 1e4 * extent_m;
  points.emplace_back(-far, -far);
  points.emplace_back(far, -far);
  points.emplace_back(0, 2 * far);
  std::vector<Open> open = {with_circumcircle({count, count + 1, count + 2}, points)};
  std::vector<std::array<int, 3>> finished;
  for (const int index : order) {
    const Eigen::Vector2d& point = points[index];
    std::erase_if(open, [&](const Open& triangle) {
      const double behind = point.x() - triangle.centre.x();
      if (behind <= 0 || behind * behind <= triangle.squared_radius) return false;
      finished.push_back(triangle.vertices);
      return true;
    });
    for (const Edge& edge : carve_cavity(open, point))
      open.push_back(with_circumcircle({edge[0], edge[1], index}, points));
  }
  for (const Open& triangle : open) finished.push_back(triangle.vertices);
  std::erase_if(finished, [&](const std::array<int, 3>& t) { return std::max({t[0], t[1], t[2]}) >= count; });
  return finished;
}

void add_outline(TriangleMesh& mesh, int columns, int rows) {
  for (int c = 0; c < columns; ++c)
    for (const double v : {0.0, mesh.height_m}) mesh.rest_uv.emplace_back(mesh.width_m * c / (columns - 1), v);
  for (int r = 1; r + 1 < rows; ++r)
    for (const double u : {0.0, mesh.width_m}) mesh.rest_uv.emplace_back(u, mesh.height_m * r / (rows - 1));
}

void add_interior(TriangleMesh& mesh, double spacing_m, double angle_rad, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> jitter(-0.15 * spacing_m, 0.15 * spacing_m);
  const Eigen::Vector2d size(mesh.width_m, mesh.height_m);
  const Eigen::Vector2d first(std::cos(angle_rad) * spacing_m, std::sin(angle_rad) * spacing_m);
  const double third = angle_rad + std::acos(-1.0) / 3;
  const Eigen::Vector2d second(std::cos(third) * spacing_m, std::sin(third) * spacing_m);
  const double margin = 0.55 * spacing_m;  // keeps triangles along the outline from being flat
  const int reach = static_cast<int>(std::ceil(size.norm() / spacing_m)) + 1;
  for (int i = -reach; i <= reach; ++i)
    for (int j = -reach; j <= reach; ++j) {
      const Eigen::Vector2d point = size / 2 + i * first + j * second;
      const double du = jitter(random), dv = jitter(random);
      const Eigen::Vector2d moved = point + Eigen::Vector2d(du, dv);
      if ((moved.array() > margin).all() && (moved.array() < size.array() - margin).all())
        mesh.rest_uv.push_back(moved);
    }
}

}  // namespace

TriangleMesh make_irregular_mesh(double width_m, double height_m, int columns, int rows, double angle_rad,
                                 unsigned seed) {
  if (!(width_m > 0 && height_m > 0) || columns < 2 || rows < 2)
    throw std::invalid_argument("make_irregular_mesh: expected at least 2x2 vertices and positive sides");
  TriangleMesh mesh;
  mesh.width_m = width_m;
  mesh.height_m = height_m;
  add_outline(mesh, columns, rows);
  // A triangular lattice of spacing s has one vertex per s²·√3/2.
  const double cell = width_m / (columns - 1) * height_m / (rows - 1);
  add_interior(mesh, std::sqrt(2 * cell / std::sqrt(3.0)), angle_rad, seed);
  mesh.triangles = triangulate(bulged(mesh), std::max(width_m, height_m));
  return mesh;
}

}  // namespace selvedge::geometry
