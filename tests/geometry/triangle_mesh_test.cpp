#include "geometry/triangle_mesh.h"

#include <map>
#include <set>

#include <Eigen/LU>
#include <gtest/gtest.h>

namespace selvedge::geometry {
namespace {

double signed_area(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  Eigen::Matrix2d edges;
  edges << mesh.rest_uv[t[1]] - mesh.rest_uv[t[0]], mesh.rest_uv[t[2]] - mesh.rest_uv[t[0]];
  return edges.determinant() / 2;
}

// Closed sheet, one sense, every outline edge on the rectangle, Euler's number of a disc.
void expect_sound(const TriangleMesh& mesh) {
  double area = 0;
  std::map<std::pair<int, int>, int> directed;
  std::set<int> used;
  for (const auto& t : mesh.triangles) {
    const double own = signed_area(mesh, t);
    EXPECT_GT(own, 0);
    area += own;
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ((++directed[{t[i], t[(i + 1) % 3]}]), 1);
      used.insert(t[i]);
    }
  }
  EXPECT_NEAR(area, mesh.width_m * mesh.height_m, 1e-12);
  EXPECT_EQ(used.size(), mesh.rest_uv.size());
  int edges = 0;
  for (const auto& [edge, count] : directed) {
    if (directed.count({edge.second, edge.first})) {
      edges += edge.first < edge.second;
      continue;
    }
    ++edges;
    const Eigen::Vector2d a = mesh.rest_uv[edge.first], b = mesh.rest_uv[edge.second];
    const bool on_side = (a.x() == b.x() && (a.x() == 0 || a.x() == mesh.width_m)) ||
                         (a.y() == b.y() && (a.y() == 0 || a.y() == mesh.height_m));
    EXPECT_TRUE(on_side) << a.transpose() << " to " << b.transpose();
  }
  EXPECT_EQ(static_cast<int>(used.size()) - edges + static_cast<int>(mesh.triangles.size()), 1);
}

TEST(GridMesh, IsSoundAndAlternatesItsDiagonals) {
  const TriangleMesh mesh = make_grid_mesh(0.3, 0.2, 7, 5);
  EXPECT_EQ(mesh.rest_uv.size(), 35u);
  EXPECT_EQ(mesh.triangles.size(), 48u);
  EXPECT_EQ(mesh.rest_uv[1 * 7 + 6], Eigen::Vector2d(0.3, 0.05));
  expect_sound(mesh);
  EXPECT_NE(mesh.triangles[1],
            (std::array<int, 3>{mesh.triangles[3][0] - 1, mesh.triangles[3][1] - 1, mesh.triangles[3][2] - 1}));
  EXPECT_THROW(make_grid_mesh(0.3, 0.2, 1, 5), std::invalid_argument);
}

TEST(IrregularMesh, IsSoundForManyAnglesAndSeeds) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    const int columns = 3 + static_cast<int>(seed % 30), rows = 3 + static_cast<int>(seed * 7 % 25);
    const double width = 0.3, height = width * (rows - 1) / (columns - 1);
    expect_sound(make_irregular_mesh(width, height, columns, rows, 0.1 * seed, seed));
  }
}

TEST(IrregularMesh, HasTheGridsDensityAndNoSliver) {
  const TriangleMesh mesh = make_irregular_mesh(0.3, 0.3, 33, 33, 0.3, 1);
  EXPECT_NEAR(static_cast<double>(mesh.rest_uv.size()), 33 * 33, 0.06 * 33 * 33);
  for (const auto& t : mesh.triangles) {
    double longest = 0;
    for (int i = 0; i < 3; ++i) longest = std::max(longest, (mesh.rest_uv[t[i]] - mesh.rest_uv[t[(i + 1) % 3]]).norm());
    const double altitude = 2 * signed_area(mesh, t) / longest;
    EXPECT_GT(altitude / longest, 0.2);
  }
}

TEST(IrregularMesh, RepeatsWithItsSeedAlone) {
  const auto first = make_irregular_mesh(0.3, 0.3, 9, 9, 0.2, 4);
  EXPECT_EQ(first.rest_uv, make_irregular_mesh(0.3, 0.3, 9, 9, 0.2, 4).rest_uv);
  EXPECT_NE(first.rest_uv, make_irregular_mesh(0.3, 0.3, 9, 9, 0.2, 5).rest_uv);
}

TEST(Locate, WeightsGiveThePointBackInsideAndOutside) {
  const TriangleMesh mesh = make_irregular_mesh(0.3, 0.2, 9, 7, 0.2, 3);
  for (const Eigen::Vector2d& uv : {Eigen::Vector2d(0.13, 0.07), Eigen::Vector2d(0.3, 0.2), Eigen::Vector2d(0, 0.1),
                                    Eigen::Vector2d(0.31, -0.01), Eigen::Vector2d(-0.02, 0.1)}) {
    const MaterialPoint point = locate(mesh, uv);
    Eigen::Vector2d back(0, 0);
    for (int i = 0; i < 3; ++i) back += point.weights(i) * mesh.rest_uv[point.vertices[i]];
    EXPECT_LT((back - uv).norm(), 1e-12);
    const bool inside = uv.x() >= 0 && uv.x() <= 0.3 && uv.y() >= 0 && uv.y() <= 0.2;
    EXPECT_EQ(point.weights.minCoeff() >= -1e-9, inside);
  }
}

TEST(NearestVertex, IsTheNearest) {
  const TriangleMesh mesh = make_grid_mesh(0.3, 0.3, 4, 4);
  EXPECT_EQ(nearest_vertex(mesh, {0.11, 0.19}), 2 * 4 + 1);
  EXPECT_EQ(nearest_vertex(mesh, {9, 9}), 15);
}

}  // namespace
}  // namespace selvedge::geometry
