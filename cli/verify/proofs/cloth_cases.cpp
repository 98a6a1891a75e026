#include "cli/verify/proofs/cloth_cases.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <tbb/task_arena.h>

#include "cli/verify/proofs/proof_fabric.h"
#include "cli/verify/thread_cpu.h"
#include "cloth/energy.h"
#include "cloth/spline/derivatives.h"
#include "cloth/spline/energy.h"
#include "cloth/spline/simulate.h"
#include "cloth/step_plan.h"
#include "cloth/surface_point.h"

namespace selvedge::cli {

using cloth::Experiment;
using cloth::Hold;
using cloth::Material;
using cloth::Options;
using cloth::Sheet;
using cloth::Trajectory;
using cloth::spline::SplineSheet;

namespace {

constexpr double kGravity_m_s2 = 9.81;

Material without_losses(double density, double stretch, double bend) {
  Material m;
  m.density = density;
  m.stretch = stretch;
  m.shear = stretch / 2;
  m.bend = bend;
  m.stretch_damping = m.shear_damping = m.bend_damping = 0;
  m.drag_normal = m.drag_tangent = 0;
  return m;
}

cloth::HeldPath still_path(Hold hold, double gap_m) {
  Eigen::Matrix3Xd left(3, 1), right(3, 1);
  left << -gap_m / 2, 0, 0;
  right << gap_m / 2, 0, 0;
  return cloth::make_path(hold, {0.0}, left, right);
}

Sheet swatch_sheet(int rows) { return cloth::make_sheet(geometry::make_grid_mesh(kSwatch_m, kSwatch_m, rows, rows)); }

// Sag of the elastica's end for weight per length and rigidity q = ρ g / B, by shooting with RK4.
double elastica_sag(double q, double length) {
  const int steps = 2000;
  const double h = length / steps;
  const auto end_of = [&](double curvature, double& sag) {
    double angle = 0, s = 0;
    sag = 0;
    const auto bend = [&](double at, double a) { return -q * (length - at) * std::cos(a); };
    for (int i = 0; i < steps; ++i, s += h) {
      const double k1 = curvature, l1 = bend(s, angle);
      const double k2 = curvature + h / 2 * l1, l2 = bend(s + h / 2, angle + h / 2 * k1);
      const double k3 = curvature + h / 2 * l2, l3 = bend(s + h / 2, angle + h / 2 * k2);
      const double k4 = curvature + h * l3, l4 = bend(s + h, angle + h * k3);
      const double middle = angle + h / 4 * (k1 + k2);
      const double next = angle + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      sag += h / 6 * (std::sin(angle) + 4 * std::sin(middle) + std::sin(next));
      angle = next;
      curvature += h / 6 * (l1 + 2 * l2 + 2 * l3 + l4);
    }
    return curvature;
  };
  double low = 0, high = q * length * length, sag = 0;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (end_of(middle, sag) < 0 ? low : high) = middle;
  }
  return sag;
}

// Depth at the middle of a catenary of the given length between ends at one height.
double catenary_depth(double length, double gap) {
  double low = 1e-3, high = 100;  // parameter a: 2 a sinh(gap / 2a) = length
  for (int i = 0; i < 200; ++i) {
    const double a = std::sqrt(low * high);
    (2 * a * std::sinh(gap / (2 * a)) > length ? low : high) = a;
  }
  return low * (std::cosh(gap / (2 * low)) - 1);
}

// Bessel function J0 for the hanging chain's shape.
double bessel_j0(double x) { return std::cyl_bessel_j(0.0, x); }

// Either kind of sheet.
template <class AnySheet>
Eigen::Vector3d at_point(const AnySheet& sheet, const Eigen::Matrix3Xd& x, const Eigen::Vector2d& uv) {
  return position_of(surface_point(sheet, uv), x);
}

using Shape = std::function<Eigen::Vector3d(const Eigen::Vector2d&)>;

Eigen::Matrix3Xd shaped(const Sheet& sheet, const Shape& shape) {
  Eigen::Matrix3Xd x(3, sheet.data.vertex_count);
  for (Eigen::Index i = 0; i < x.cols(); ++i) x.col(i) = shape(sheet.mesh.rest_uv[static_cast<size_t>(i)]);
  return x;
}

Eigen::Matrix3Xd shaped(const SplineSheet& sheet, const Shape& shape) { return control_points_through(sheet, shape); }

SplineSheet spline_sheet(double width_m, double height_m, double cell_m, Hold hold) {
  cloth::spline::Swatch swatch;
  swatch.width_m = width_m;
  swatch.height_m = height_m;
  return make_spline_sheet(swatch, make_grid(swatch, hold, cell_m));
}

// Narrow: it bends about one axis only.
template <class AnySheet>
Compared cantilever_on(const AnySheet& sheet, double width_m) {
  Experiment e;
  e.material = without_losses(0.16, 5000, 6e-3);
  e.path = still_path(Hold::top_edge_clamped, width_m);
  e.path.clamp_direction = {0, 1, 0};
  e.start_shape = shaped(sheet, [&](const Eigen::Vector2d& uv) {
    return Eigen::Vector3d(uv.x() - width_m / 2, uv.y(), -0.01 * uv.y() * uv.y());
  });
  const Eigen::Matrix3Xd rest = relax(sheet, {e})[0].position;
  return {-at_point(sheet, rest, {width_m / 2, kSwatch_m}).z(), elastica_sag(0.16 * kGravity_m_s2 / 6e-3, kSwatch_m)};
}

template <class AnySheet>
Compared catenary_on(const AnySheet& sheet, double height_m) {
  const double gap = 0.25;
  Experiment e;
  e.material = without_losses(0.16, 2000, 1e-7);
  e.path = still_path(Hold::side_edges, gap);
  e.path.clamp_direction = {0, 1, 0};
  e.start_shape = shaped(sheet, [&](const Eigen::Vector2d& uv) {
    const double from_middle = 2 * uv.x() / kSwatch_m - 1, depth = std::sqrt(kSwatch_m * kSwatch_m - gap * gap) / 2;
    return Eigen::Vector3d(gap / 2 * from_middle, uv.y(), -depth * (1 - std::abs(from_middle)));
  });
  const Eigen::Matrix3Xd rest = relax(sheet, {e})[0].position;
  return {-at_point(sheet, rest, {kSwatch_m / 2, height_m / 2}).z(), catenary_depth(kSwatch_m, gap)};
}

template <class AnySheet>
Compared pendulum_on(const AnySheet& sheet, double width_m, double bend) {
  Experiment e;
  e.material = without_losses(0.16, 300, bend);
  e.path = still_path(Hold::top_edge, width_m);
  e.starts_at_rest = false;
  e.start_shape = shaped(sheet, [&](const Eigen::Vector2d& uv) {
    // Stretched by its weight below, so that no up-and-down swing is excited.
    const double stretched = uv.y() + 0.16 * kGravity_m_s2 / 300 * (kSwatch_m * uv.y() - uv.y() * uv.y() / 2);
    return Eigen::Vector3d(uv.x() - width_m / 2, 2e-3 * bessel_j0(2.404826 * std::sqrt(1 - uv.y() / kSwatch_m)),
                           -stretched);
  });
  for (int k = 1; k <= 1000; ++k) e.sample_s.push_back(k * 1e-3);
  const Trajectory t = simulate(sheet, {e})[0];
  // Passes through the middle a quarter and three quarters into the period.
  std::vector<double> crossings;
  double before = 1;
  for (size_t k = 0; k < t.samples.size(); ++k) {
    const double y = at_point(sheet, t.samples[k], {width_m / 2, kSwatch_m}).y();
    if (before * y < 0) crossings.push_back(e.sample_s[k] - 1e-3 * y / (y - before));
    before = y;
  }
  const double strain = 0.16 * kGravity_m_s2 * kSwatch_m / 300 / 2;
  const double length = kSwatch_m * (1 + strain);
  return {crossings.size() < 2 ? 0 : 2 * (crossings[1] - crossings[0]),
          2 * M_PI / (2.404826 / 2 * std::sqrt(kGravity_m_s2 / length))};
}

// A hung sheet without losses, let go from where it hangs when tilted by 20 degrees.
template <class AnySheet>
Experiment let_go(const AnySheet& sheet) {
  Experiment e;
  e.material = without_losses(0.16, 110, 5e-5);
  e.path = still_path(Hold::corners, 0.255);
  e.start_shape = hung_shape(sheet, e, 1);
  const Eigen::Vector3d upright = e.gravity_m_s2;
  e.gravity_m_s2 = kGravity_m_s2 * Eigen::Vector3d(0, std::sin(0.35), -std::cos(0.35));
  e.start_shape = relax(sheet, {e})[0].position;
  e.starts_at_rest = false;
  e.gravity_m_s2 = upright;
  return e;
}

double potential_J(const Sheet& sheet, const Experiment& e, const Eigen::Matrix3Xd& x) {
  return cloth::energy_of(sheet, e.material, e.gravity_m_s2, x, Eigen::Matrix3Xd::Zero(3, x.cols())).potential();
}

struct Energy {
  double kinetic_J = 0, total_J = 0;
};

// At the steps nearest to look_s. The kinetic part is ½ v₋·M v₊ of the two half steps: with it leapfrog keeps the
// energy of each mode exactly.
std::vector<Energy> energies_at(const Sheet& sheet, Experiment e, const Options& options,
                                const std::vector<double>& look_s) {
  for (const double t : look_s)
    for (int d = -1; d <= 1; ++d) e.sample_s.push_back((std::round(t / options.step_s) + d) * options.step_s);
  const Trajectory t = cloth::simulate(sheet, {e}, options)[0];
  const Eigen::VectorXd mass = cloth::vertex_masses(sheet, e.material);
  std::vector<Energy> out;
  for (size_t k = 0; k < look_s.size(); ++k) {
    const Eigen::Matrix3Xd &before = t.samples[3 * k], &here = t.samples[3 * k + 1], &after = t.samples[3 * k + 2];
    const double h2 = options.step_s * options.step_s;
    const double kinetic = 0.5 * (here - before).cwiseProduct(after - here).colwise().sum().dot(mass.transpose()) / h2;
    out.push_back({kinetic, kinetic + potential_J(sheet, e, here)});
  }
  return out;
}

}  // namespace

double Compared::relative_error() const { return std::abs(simulated / reference - 1); }

Compared cantilever_sag(int rows) {
  const double width = 4 * kSwatch_m / (rows - 1);
  return cantilever_on(cloth::make_sheet(geometry::make_grid_mesh(width, kSwatch_m, 5, rows)), width);
}

Compared catenary_sag(int columns) {
  const double height = 4 * kSwatch_m / (columns - 1);
  return catenary_on(cloth::make_sheet(geometry::make_grid_mesh(kSwatch_m, height, columns, 5)), height);
}

Compared pendulum_period(int rows) {
  const double width = 4 * kSwatch_m / (rows - 1);
  return pendulum_on(cloth::make_sheet(geometry::make_grid_mesh(width, kSwatch_m, 5, rows)), width, 1e-7);
}

Compared spline_cantilever_sag(int cells) {
  const double cell = kSwatch_m / cells;
  return cantilever_on(spline_sheet(4 * cell, kSwatch_m, cell, Hold::top_edge_clamped), 4 * cell);
}

Compared spline_catenary_sag(int cells) {
  const double cell = kSwatch_m / cells;
  return catenary_on(spline_sheet(kSwatch_m, 4 * cell, cell, Hold::side_edges), 4 * cell);
}

Compared spline_pendulum_period(int cells) {
  const double cell = kSwatch_m / cells;
  return pendulum_on(spline_sheet(4 * cell, kSwatch_m, cell, Hold::top_edge), 4 * cell, 1e-5);
}

double spline_energy_kept(int cells, double duration_s) {
  namespace spline = cloth::spline;
  const SplineSheet sheet = spline_sheet(kSwatch_m, kSwatch_m, kSwatch_m / cells, Hold::corners);
  Experiment e = let_go(sheet);
  spline::Options options;
  options.precision = spline::Precision::twofold;
  options.step_s = 0.3 * spline::common_step_s(sheet, {e});
  const double last = std::round(duration_s / options.step_s);
  for (int d = -1; d <= 1; ++d) e.sample_s.push_back((last + d) * options.step_s);
  const Trajectory t = spline::simulate(sheet, {e}, options)[0];
  const auto energy = [&](const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& v) {
    return spline::energy_of(sheet, e.material, e.gravity_m_s2, x, v).total();
  };
  const Eigen::Matrix3Xd still = Eigen::Matrix3Xd::Zero(3, sheet.count());
  const double rest = energy(spline::relax(sheet, {e})[0].position, still);
  const Eigen::Matrix3Xd velocity = (t.samples[2] - t.samples[0]) / (2 * options.step_s);
  return (energy(t.samples[1], velocity) - rest) / (energy(e.start_shape, still) - rest);
}

Compared terminal_speed(int rows) {
  const Sheet sheet = swatch_sheet(rows);
  cloth::kernel::RunInput in;
  in.sheet = &sheet.data;
  in.materials.push_back(Material());
  in.surroundings.emplace_back();
  for (const Eigen::Vector2d& uv : sheet.mesh.rest_uv)
    in.start_position.insert(in.start_position.end(), {uv.x(), uv.y(), 0});
  in.step_s = cloth::stable_step_s(sheet, in.materials[0]) / 3;
  in.stages = cloth::stages_for(cloth::spectrum_of(sheet, in.materials[0]), in.step_s);
  in.steps = static_cast<int>(2 / in.step_s);
  in.held_corners.assign(static_cast<size_t>(in.steps + 1) * 6, 0);
  const cloth::kernel::RunOutput out = cloth::kernel::run(in);
  const Material& m = in.materials[0];
  const double weight = m.density * kGravity_m_s2;
  return {-out.final_velocity[2], std::sqrt(weight / (m.drag_normal - m.drag_fade * weight))};
}

Compared cylinder_energy(const geometry::TriangleMesh& mesh, double angle_rad) {
  const Sheet sheet = cloth::make_sheet(mesh);
  const double radius = 0.1;
  const Eigen::Vector2d across(std::cos(angle_rad), std::sin(angle_rad)), along(-across.y(), across.x());
  Eigen::Matrix3Xd x(3, sheet.data.vertex_count);
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Eigen::Vector2d& uv = mesh.rest_uv[static_cast<size_t>(i)];
    const double turn = across.dot(uv) / radius;
    x.col(i) << radius * std::sin(turn), along.dot(uv), radius * std::cos(turn);
  }
  Material m;
  const double energy =
      cloth::energy_of(sheet, m, Eigen::Vector3d::Zero(), x, Eigen::Matrix3Xd::Zero(3, x.cols())).bend;
  return {energy, 0.5 * m.bend / (radius * radius) * mesh.width_m * mesh.height_m};
}

double energy_drift(int rows, double duration_s) {
  const Sheet sheet = swatch_sheet(rows);
  const Experiment e = let_go(sheet);
  Options options;
  options.step_s = 0.3 * cloth::common_step_s(sheet, {e});
  const int looks = 20;
  std::vector<double> look_s;
  for (int k = 0; k < looks; ++k) look_s.push_back(0.01 + (duration_s - 0.02) * k / (looks - 1));
  const std::vector<Energy> energies = energies_at(sheet, e, options, look_s);
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest, moving = 0;
  for (const Energy& energy : energies) {
    lowest = std::min(lowest, energy.total_J);
    highest = std::max(highest, energy.total_J);
    moving = std::max(moving, energy.kinetic_J);
  }
  return (highest - lowest) / moving;
}

double energy_kept(int rows, double duration_s, Options::Integrator integrator, double step_s) {
  const Sheet sheet = swatch_sheet(rows);
  const Experiment e = let_go(sheet);
  Options options;
  options.integrator = integrator;
  options.step_s = step_s > 0 ? step_s : 0.3 * cloth::common_step_s(sheet, {e});
  const double end = energies_at(sheet, e, options, {duration_s - options.step_s})[0].total_J;
  const double rest = potential_J(sheet, e, cloth::relax(sheet, {e})[0].position);
  return (end - rest) / (potential_J(sheet, e, e.start_shape) - rest);
}

Experiment waving_experiment(double amplitude_m, int frames) {
  Experiment e;
  e.material = proof_fabric();
  e.material.bend = 5e-5;
  e.material.density = 0.16;
  const Eigen::Index samples = 400;
  std::vector<double> time_s;
  Eigen::Matrix3Xd left(3, samples), right(3, samples);
  for (Eigen::Index i = 0; i < samples; ++i) {
    time_s.push_back(0.005 * static_cast<double>(i));
    const double swing = 0.5 * (1 - std::cos(2 * M_PI * 1.5 * time_s.back()));
    left.col(i) << -0.1275, 0, 0;
    right.col(i) << 0.1275, amplitude_m * swing, 0.1 * amplitude_m * swing;
  }
  e.path = cloth::make_path(Hold::corners, time_s, left, right);
  for (int k = 1; k <= frames; ++k) e.sample_s.push_back(k / 30.0);
  return e;
}

Waving wave(const geometry::TriangleMesh& mesh, int frames, const Waving* branch) {
  Waving w{cloth::make_sheet(mesh, cloth::Sides::arcs), {}};
  Experiment e = waving_experiment(0.1, frames);
  e.start_shape = cloth::hung_shape(w.sheet, e, 1);
  if (branch)
    for (Eigen::Index i = 0; i < e.start_shape.cols(); ++i)
      e.start_shape.col(i) = at_point(branch->sheet, branch->motion.start, mesh.rest_uv[static_cast<size_t>(i)]);
  w.motion = cloth::simulate(w.sheet, {e})[0];
  return w;
}

double distance_m(const Waving& a, const Waving& b) {
  double sum = 0;
  const geometry::TriangleMesh points = geometry::make_grid_mesh(kSwatch_m, kSwatch_m, 17, 17);
  for (const Eigen::Vector2d& uv : points.rest_uv) {
    const cloth::SurfacePoint p = cloth::surface_point(a.sheet, uv), q = cloth::surface_point(b.sheet, uv);
    for (size_t k = 0; k < a.motion.samples.size(); ++k)
      sum += (position_of(p, a.motion.samples[k]) - position_of(q, b.motion.samples[k])).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(points.rest_uv.size() * a.motion.samples.size()));
}

SplineWaving spline_wave(int cells, int frames, const SplineWaving* branch) {
  SplineWaving w{spline_sheet(kSwatch_m, kSwatch_m, kSwatch_m / cells, Hold::corners), {}, {}};
  Experiment e = waving_experiment(0.1, frames);
  e.start_shape =
      branch ? carried_over(branch->sheet, branch->rest, w.sheet) : cloth::spline::hung_shape(w.sheet, e, 1);
  const Trajectory t = cloth::spline::simulate(w.sheet, {e})[0];
  w.rest = t.start;
  const geometry::TriangleMesh grid = geometry::make_grid_mesh(kSwatch_m, kSwatch_m, 17, 17);
  for (const Eigen::Matrix3Xd& control : t.samples) {
    Eigen::Matrix3Xd at(3, static_cast<Eigen::Index>(grid.rest_uv.size()));
    for (Eigen::Index i = 0; i < at.cols(); ++i)
      at.col(i) = position_of(surface_point(w.sheet, grid.rest_uv[static_cast<size_t>(i)]), control);
    w.points.push_back(std::move(at));
  }
  return w;
}

double distance_m(const SplineWaving& a, const SplineWaving& b) {
  double sum = 0, count = 0;
  for (size_t k = 0; k < a.points.size(); ++k) {
    sum += (a.points[k] - b.points[k]).squaredNorm();
    count += static_cast<double>(a.points[k].cols());
  }
  return std::sqrt(sum / count);
}

double cost_of_nine_derivatives(int cells) {
  namespace spline = cloth::spline;
  const SplineSheet sheet = spline_sheet(kSwatch_m, kSwatch_m, kSwatch_m / cells, Hold::corners);
  Experiment e = waving_experiment(0.1, 15);
  e.start_shape = spline::hung_shape(sheet, e, 1);
  e.start_shape = spline::relax(sheet, {e})[0].position;
  e.starts_at_rest = false;
  std::vector<spline::Direction> by;
  for (double Material::*member :
       {&Material::stretch, &Material::shear, &Material::bend, &Material::stretch_damping, &Material::shear_damping,
        &Material::bend_damping, &Material::drag_normal, &Material::drag_tangent, &Material::density})
    by.push_back({member, 1e-3 * e.material.*member});
  double alone = std::numeric_limits<double>::infinity(), all = alone;
  tbb::task_arena(1).execute([&] {
    for (int k = 0; k < 3; ++k) {
      const double start = thread_cpu_s();
      spline::simulate(sheet, {e});
      const double between = thread_cpu_s();
      spline::derivatives(sheet, e, by);
      alone = std::min(alone, between - start);
      all = std::min(all, thread_cpu_s() - between);
    }
  });
  return all / alone;
}

double order_of(double coarse_difference, double fine_difference) {
  return std::log2(coarse_difference / fine_difference);
}

}  // namespace selvedge::cli
