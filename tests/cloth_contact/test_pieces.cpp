// The parts of contact, each against what it must be by definition.
#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "cloth/contact/closest.h"
#include "cloth/contact/intersections.h"
#include "cloth/contact/solver.h"
#include "geometry/triangle_mesh.h"

namespace selvedge::cloth::contact {
namespace {

struct Dice {
  explicit Dice(unsigned seed) : random(seed) {}
  double operator()() { return std::uniform_real_distribution<double>(-1, 1)(random); }
  Eigen::Vector3d vector() { return {(*this)(), (*this)(), (*this)()}; }
  std::mt19937 random;
};

// Nearest of many sampled points of both features.
double sampled_distance(Kind kind, const Four& x) {
  double least = 1e9;
  const int n = 60;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) {
      const double s = double(i) / n, t = double(j) / n;
      if (kind == Kind::edge_edge)
        least = std::min(least, (x[0] + s * (x[1] - x[0]) - x[2] - t * (x[3] - x[2])).norm());
      else if (s + t <= 1) least = std::min(least, (x[0] - x[1] - s * (x[2] - x[1]) - t * (x[3] - x[1])).norm());
    }
  return least;
}

TEST(Closest, IsTheLeastDistanceOfAllPoints) {
  Dice dice(1);
  for (int k = 0; k < 400; ++k) {
    const Kind kind = k % 2 ? Kind::edge_edge : Kind::vertex_triangle;
    const Four x = {dice.vector(), dice.vector(), dice.vector(), dice.vector()};
    const Closest at = closest(kind, x);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < 4; ++i) sum += at.weight[i] * x[i];
    EXPECT_LT((sum - at.separation).norm(), 1e-12);
    const double sampled = sampled_distance(kind, x);
    EXPECT_LE(at.distance, sampled + 1e-12);
    EXPECT_GT(at.distance, sampled - 0.06);
  }
}

TEST(Closest, ApproachesAreFoundInTimeAndNeverMissed) {
  Dice dice(2);
  int met = 0;
  for (int k = 0; k < 400; ++k) {
    const Kind kind = k % 2 ? Kind::edge_edge : Kind::vertex_triangle;
    const Four x = {dice.vector(), dice.vector(), dice.vector(), dice.vector()};
    Four p = {2 * dice.vector(), 2 * dice.vector(), 2 * dice.vector(), 2 * dice.vector()};
    const double least = 0.05 * closest(kind, x).distance;
    const auto time = time_of_approach(kind, x, p, closest(kind, x).distance, least);
    met += time.has_value();
    for (int i = 0; i <= 400; ++i) {
      const double t = i / 400.0;
      if (time && t > *time) break;
      Four y = x;
      for (size_t c = 0; c < 4; ++c) y[c] += t * p[c];
      EXPECT_GT(closest(kind, y).distance, least) << "pair " << k << " at " << t;
    }
  }
  EXPECT_GT(met, 20);
  EXPECT_LT(met, 380);
}

TEST(Intersections, AreSeenWhereASheetPassesThroughItself) {
  const geometry::TriangleMesh mesh = geometry::make_grid_mesh(0.2, 0.2, 9, 9);
  const Surface surface = make_surface(mesh);
  Eigen::Matrix3Xd x(3, 81);
  for (int i = 0; i < 81; ++i) {
    const Eigen::Vector2d p = mesh.rest_uv[size_t(i)];
    x.col(i) = Eigen::Vector3d(p.x(), p.y(), 0.01 * std::sin(20 * p.x()));
  }
  EXPECT_TRUE(intersecting_triangles(surface, x).empty());
  for (int i = 0; i < 81; ++i) {  // an eight
    const double angle = 10 * M_PI * mesh.rest_uv[size_t(i)].x() + 0.1;
    x.col(i) = Eigen::Vector3d(0.05 * std::sin(2 * angle), mesh.rest_uv[size_t(i)].y(), 0.1 * std::sin(angle));
  }
  EXPECT_FALSE(intersecting_triangles(surface, x).empty());
  EXPECT_TRUE(crosses({0.2, 0.2, -1}, {0.2, 0.2, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  EXPECT_FALSE(crosses({0.7, 0.7, -1}, {0.7, 0.7, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  EXPECT_FALSE(crosses({0.2, 0.2, 0.1}, {0.2, 0.2, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
}

// A sheet rolled into a spiral, nearly without stretch.
Eigen::Matrix3Xd rolled(const geometry::TriangleMesh& mesh, double turns, double pitch_m) {
  Eigen::Matrix3Xd x(3, Eigen::Index(mesh.rest_uv.size()));
  for (size_t i = 0; i < mesh.rest_uv.size(); ++i) {
    const double angle = 2 * M_PI * turns * mesh.rest_uv[i].x() / mesh.width_m,
                 radius = mesh.width_m / (2 * M_PI * turns) + pitch_m * (angle / (2 * M_PI) - turns / 2);
    x.col(Eigen::Index(i)) = Eigen::Vector3d(radius * std::cos(angle), mesh.rest_uv[i].y(), radius * std::sin(angle));
  }
  return x;
}

TEST(Hierarchy, CurvatureCriterionLosesNoPair) {
  const geometry::TriangleMesh mesh = geometry::make_grid_mesh(0.3, 0.3, 33, 33);
  const Surface surface = make_surface(mesh);
  const double reach = 0.65 * surface.least_height_m;
  for (const double turns : {0.001, 0.2, 1.5, 2.5}) {
    const Eigen::Matrix3Xd x = rolled(mesh, turns, 0.003);
    size_t pairs[2], triangles[2];
    for (const bool culled : {false, true}) {
      Hierarchy tree(surface);
      tree.set_culling(culled);
      tree.update(x);
      std::vector<std::array<int, 2>> found;
      tree.near_itself(reach, found);
      triangles[culled] = found.size();
      PairList list(surface);
      list.rebuild(tree, x, reach, 0);
      pairs[culled] = list.size();
    }
    EXPECT_EQ(pairs[0], pairs[1]) << turns << " turns";
    if (turns > 1) {
      EXPECT_GT(pairs[0], 1000u);
    } else {
      EXPECT_LT(triangles[1], triangles[0] / 4) << turns << " turns: the criterion should spare work";
    }
  }
}

// Layers thrown at each other so fast that a step would carry them through.
struct Throw {
  geometry::TriangleMesh mesh = geometry::make_grid_mesh(0.2, 0.2, 13, 13);
  Surface surface = make_surface(mesh);
  Eigen::Matrix3Xd x = rolled(mesh, 2, 0.006), v;
  std::vector<double> inverse_mass = std::vector<double>(169, 4e4);
  double step_s = 2e-3;

  explicit Throw(unsigned seed, double speed_m_s) {
    Dice dice(seed);
    v.resize(3, 169);
    for (int i = 0; i < 169; ++i) v.col(i) = speed_m_s * dice.vector();
  }
  Statistics step(Eigen::Matrix3Xd& after, const Options& options = {}) {
    Eigen::Matrix3Xd before = x;
    after = x + step_s * v;
    Solver solver(surface, {}, options);
    solver.apply({0, step_s, step_s, 169, before.data(), after.data(), v.data(), inverse_mass.data()});
    return solver.statistics();
  }
};

// Throws of growing speed; returns what the solver did over all of them.
Statistics throw_layers(const Options& options, double fastest_m_s) {
  Statistics all;
  int would = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    Throw t(seed, fastest_m_s * seed / 12);
    would += !intersecting_triangles(t.surface, t.x + t.step_s * t.v).empty();
    EXPECT_TRUE(intersecting_triangles(t.surface, t.x).empty());
    Eigen::Matrix3Xd after;
    const Eigen::Vector3d momentum = t.v.rowwise().sum();
    const Statistics s = t.step(after, options);
    all.impacts += s.impacts;
    all.zone_steps += s.zone_steps;
    EXPECT_TRUE(intersecting_triangles(t.surface, after).empty()) << "seed " << seed;
    EXPECT_EQ(s.unresolved, 0) << "seed " << seed;
    EXPECT_LT((t.v.rowwise().sum() - momentum).norm(), 1e-9 * t.v.norm()) << "momentum, seed " << seed;
    EXPECT_LE(s.work_J, 0);
  }
  EXPECT_GT(would, 6);
  return all;
}

TEST(Solver, StopsWhatWouldPassThroughInOneStep) { EXPECT_GT(throw_layers({}, 12).impacts, 100); }

TEST(Solver, MovesAsRigidZonesWhatImpulsesLeave) {
  Options options;
  options.impact_rounds = 0;
  EXPECT_GT(throw_layers(options, 6).zone_steps, 6);
}

TEST(Solver, GivesTheSameBitsTwice) {
  Throw one(3, 3), two(3, 3);
  Eigen::Matrix3Xd a, b;
  one.step(a);
  two.step(b);
  EXPECT_EQ(a, b);
}

}  // namespace
}  // namespace selvedge::cloth::contact
