#include "cli/verify/proofs/contact_cases.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include <Eigen/Geometry>

#include "cli/verify/proofs/proof_fabric.h"
#include "cloth/contact/intersections.h"

namespace selvedge::cli {

namespace {

constexpr double kSide_m = 0.3;

// Knit to stiff cotton.
cloth::Material fabric_of(std::mt19937& random) {
  const auto between = [&](double low, double high) {
    return low * std::pow(high / low, std::generate_canonical<double, 32>(random));
  };
  cloth::Material m = proof_fabric();
  m.density = between(0.1, 0.3);
  m.stretch = between(30, 150);
  m.shear = between(20, 80);
  m.bend = between(5e-6, 2e-4);
  return m;
}

ContactScene free_sheet(int columns, double duration_s) {
  ContactScene s;
  s.experiment.material = proof_fabric();
  s.mesh = geometry::make_grid_mesh(kSide_m, kSide_m, columns, columns);
  cloth::Experiment& e = s.experiment;
  e.path = cloth::make_path(cloth::Hold::nothing, {0}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  e.starts_at_rest = false;
  e.start_shape.resize(3, static_cast<Eigen::Index>(s.mesh.rest_uv.size()));
  for (double t = 0.02; t < duration_s + 1e-9; t += 0.02) e.sample_s.push_back(t);
  return s;
}

}  // namespace

ContactScene sheet_over_rod(unsigned seed, int columns, double duration_s) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  ContactScene s = free_sheet(columns, duration_s);
  s.experiment.material = fabric_of(random);
  const double height = 0.16;
  const Eigen::Matrix3d turned = (Eigen::AngleAxisd(std::numbers::pi * unit(random), Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(0.35 * unit(random), Eigen::Vector3d::UnitX()))
                                     .toRotationMatrix();
  const Eigen::Vector3d centre(0.06 * unit(random), 0.06 * unit(random), height + 0.08);
  for (size_t i = 0; i < s.mesh.rest_uv.size(); ++i) {
    const Eigen::Vector2d p = s.mesh.rest_uv[i] - Eigen::Vector2d::Constant(kSide_m / 2);
    s.experiment.start_shape.col(static_cast<Eigen::Index>(i)) =
        centre + turned * Eigen::Vector3d(p.x(), p.y(), 1e-4 * unit(random));
  }
  const double radius = 0.006 + 0.004 * (unit(random) + 1);
  s.body.capsules_at = [=](double) {
    return std::vector<cloth::contact::Capsule>{{{-0.4, 0, height}, {0.4, 0, height}, radius}};
  };
  s.body.half_spaces = {{Eigen::Vector3d::UnitZ(), 0}};
  s.options.body_friction = 0.2 + 0.2 * (unit(random) + 1);
  return s;
}

ContactScene folded_sheet(unsigned seed, int columns, double duration_s) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  ContactScene s = free_sheet(columns, duration_s);
  s.experiment.material = fabric_of(random);
  // Around a line across the sheet: flat, half a turn of this radius, and flat above.
  const double radius = 0.009 + 0.003 * unit(random), askew = 0.5 * unit(random), aside = 0.04 * unit(random);
  const Eigen::Vector2d across(std::cos(askew), std::sin(askew)), along(-std::sin(askew), std::cos(askew));
  const double arc = std::numbers::pi * radius;
  for (size_t i = 0; i < s.mesh.rest_uv.size(); ++i) {
    const Eigen::Vector2d p = s.mesh.rest_uv[i] - Eigen::Vector2d::Constant(kSide_m / 2);
    const double q = p.dot(across) - aside, r = p.dot(along);
    const double x = q < 0 ? q : q < arc ? radius * std::sin(q / radius) : arc - q;
    const double z = q < 0 ? 0 : q < arc ? radius * (1 - std::cos(q / radius)) : 2 * radius;
    s.experiment.start_shape.col(static_cast<Eigen::Index>(i)) = Eigen::Vector3d(x, r, 0.02 + z + 1e-4 * unit(random));
  }
  s.body.half_spaces = {{Eigen::Vector3d::UnitZ(), 0}};
  return s;
}

ContactScene patch_on_incline(double angle_rad, double friction, double duration_s) {
  ContactScene s = free_sheet(9, duration_s);
  s.mesh = geometry::make_grid_mesh(0.08, 0.08, 9, 9);
  s.experiment.start_shape.resize(3, 81);
  s.options.body_friction = friction;
  s.experiment.material.drag_normal = s.experiment.material.drag_tangent = 0;
  const Eigen::Vector3d downhill(std::cos(angle_rad), 0, -std::sin(angle_rad)),
      normal(std::sin(angle_rad), 0, std::cos(angle_rad));
  for (size_t i = 0; i < 81; ++i) {
    const Eigen::Vector2d p = s.mesh.rest_uv[i];
    s.experiment.start_shape.col(static_cast<Eigen::Index>(i)) =
        p.x() * downhill + p.y() * Eigen::Vector3d::UnitY() + 1e-3 * normal;
  }
  s.body.half_spaces = {{normal, 0}};
  return s;
}

ContactScene waved_swatch(int columns, double duration_s) {
  ContactScene s = free_sheet(columns, duration_s);
  std::vector<double> times;
  for (double t = 0; t < duration_s + 0.1; t += 0.02) times.push_back(t);
  Eigen::Matrix3Xd left(3, times.size()), right = left;
  for (size_t i = 0; i < times.size(); ++i) {
    left.col(Eigen::Index(i)) = Eigen::Vector3d(-0.125, 0, 0);
    right.col(Eigen::Index(i)) =
        Eigen::Vector3d(0.125, 0.05 * (1 - std::cos(2 * std::numbers::pi * 1.5 * times[i])), 0);
  }
  s.experiment.path = cloth::make_path(cloth::Hold::corners, times, left, right);
  s.experiment.material.density = 0.187;
  s.experiment.material.stretch = 33;
  s.experiment.material.shear = 18;
  s.experiment.start_shape = cloth::hung_shape(cloth::make_sheet(s.mesh), s.experiment, 1);
  return s;
}

ContactOutcome run_contact_scene(const ContactScene& scene, bool with_contact, const cloth::Options& options) {
  const cloth::Sheet sheet = cloth::make_sheet(scene.mesh);
  const cloth::contact::Surface surface = cloth::contact::make_surface(scene.mesh);
  const auto statistics = std::make_shared<cloth::contact::Statistics>();
  cloth::Experiment e = scene.experiment;
  if (with_contact)
    e.make_step_filter = [&] { return cloth::contact::make_filter(surface, scene.body, scene.options, statistics); };
  ContactOutcome out;
  const auto start = std::chrono::steady_clock::now();
  out.trajectory = cloth::simulate(sheet, {e}, options)[0];
  out.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  out.statistics = *statistics;
  for (const Eigen::Matrix3Xd& sample : out.trajectory.samples)
    out.intersections =
        std::max(out.intersections, static_cast<int>(cloth::contact::intersecting_triangles(surface, sample).size()));
  return out;
}

}  // namespace selvedge::cli
