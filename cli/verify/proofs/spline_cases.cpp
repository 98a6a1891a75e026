#include "cli/verify/proofs/spline_cases.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <tbb/task_arena.h>

#include "cli/verify/thread_cpu.h"
#include "cloth/spline/kernel/tables.h"
#include "cloth/spline/settle.h"
#include "cloth/spline/simulate.h"

namespace selvedge::cli {

namespace {

using cloth::Experiment;
using cloth::Hold;
using cloth::SurfacePoint;
using Eigen::Index;
using Eigen::Matrix3Xd;

constexpr double kSide_m = 0.3, kPull_per_s = 5;
constexpr int kMarkers = 25;

Eigen::Vector2d marker(int k) { return kSide_m * Eigen::Vector2d(0.05 + 0.225 * (k % 5), 0.05 + 0.225 * (k / 5)); }

// 0: the right corner waved by 5 cm at 1.25 Hz, mostly out of the plane; 1: both at 1.1 Hz; 2: an edge, likewise.
Experiment motion_of(const cloth::Material& material, int motion, double duration_s) {
  Experiment e;
  e.material = material;
  const bool edge = motion == 2;
  const double half = edge ? kSide_m / 2 : 0.425 * kSide_m;
  const Index samples = static_cast<Index>(duration_s / 0.005) + 20;
  std::vector<double> time_s;
  Matrix3Xd left(3, samples), right(3, samples);
  for (Index i = 0; i < samples; ++i) {
    const double t = 0.005 * static_cast<double>(i), rise = std::min(1.0, t / 0.3);
    const double swing = 0.05 * std::sin(2 * M_PI * (motion == 0 ? 1.25 : 1.1) * t) * rise * rise * (3 - 2 * rise);
    time_s.push_back(t);
    const Eigen::Vector3d away = motion == 0 ? Eigen::Vector3d(-0.2 * std::abs(swing), 0.9 * swing, 0.3 * swing)
                                             : swing * Eigen::Vector3d(0.6, 0.8, 0);
    left.col(i) = Eigen::Vector3d(-half, 0, 0);
    if (motion != 0) left.col(i) += away;
    right.col(i) = Eigen::Vector3d(half, 0, 0) + away;
  }
  e.path = cloth::make_path(edge ? Hold::top_edge : Hold::corners, time_s, left, right);
  for (double t = 0; t <= duration_s + 1e-9; t += 0.005) e.sample_s.push_back(t);
  return e;
}

// Of all markers at all samples, marker by marker: what a guide reads.
template <class SheetOf>
Matrix3Xd track_of(const SheetOf& sheet, const cloth::Trajectory& t) {
  const auto samples = static_cast<Index>(t.samples.size());
  Matrix3Xd out(3, kMarkers * samples);
  for (int k = 0; k < kMarkers; ++k) {
    const SurfacePoint point = surface_point(sheet, marker(k));
    for (Index s = 0; s < samples; ++s)
      out.col(k * samples + s) = position_of(point, t.samples[static_cast<size_t>(s)]);
  }
  return out;
}

double rms_mm(const Matrix3Xd& a, const Matrix3Xd& b) {
  return 1e3 * std::sqrt((a - b).squaredNorm() / static_cast<double>(a.cols()));
}

std::shared_ptr<cloth::Guide> guide_to(const Matrix3Xd& track, const std::vector<double>& time_s,
                                       std::vector<SurfacePoint> points) {
  auto seen = std::make_shared<cloth::GuideTrack>();
  seen->points = std::move(points);
  seen->time_s = time_s;
  seen->position = track;
  auto guide = std::make_shared<cloth::Guide>();
  guide->track = seen;
  guide->nudging_per_s = kPull_per_s;
  return guide;
}

template <class SheetOf>
std::vector<SurfacePoint> markers_on(const SheetOf& sheet) {
  std::vector<SurfacePoint> points;
  for (int k = 0; k < kMarkers; ++k) points.push_back(surface_point(sheet, marker(k)));
  return points;
}

std::vector<double> halved(const std::vector<double>& breaks) {
  std::vector<double> out;
  for (size_t i = 0; i + 1 < breaks.size(); ++i) {
    out.push_back(breaks[i]);
    out.push_back((breaks[i] + breaks[i + 1]) / 2);
  }
  out.push_back(breaks.back());
  return out;
}

double batch_cost(const cloth::spline::SplineSheet& sheet, const Experiment& e) {
  std::vector<Experiment> lanes(static_cast<size_t>(cloth::spline::kernel::most_lanes<float>()), e);
  for (Experiment& lane : lanes) {
    lane.sample_s = {0.1};
    lane.starts_at_rest = false;
  }
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 2; ++k)
    tbb::task_arena(1).execute([&] {
      const double start = thread_cpu_s();
      cloth::spline::simulate(sheet, lanes);
      least = std::min(least, thread_cpu_s() - start);
    });
  return least / 0.1 / static_cast<double>(lanes.size());
}

// The triangles of about the same cost: 33 columns of straight sides, from the equilibrium nearest to the reference's.
double triangles_mm(const cloth::Sheet& sheet, Experiment e, const Matrix3Xd& reference, double* cost) {
  e.starts_at_rest = true;
  tbb::task_arena(1).execute([&] { e.start_shape = cloth::relax(sheet, {e})[0].position; });
  e.starts_at_rest = false;
  const double moving = thread_cpu_s();
  cloth::Trajectory t;
  tbb::task_arena(1).execute([&] { t = cloth::simulate(sheet, {e})[0]; });
  if (cost) *cost = (thread_cpu_s() - moving) / e.sample_s.back();
  return t.finite ? rms_mm(track_of(sheet, t), reference) : std::numeric_limits<double>::infinity();
}

}  // namespace

SplineCase run_spline_case(const DrawnFabric& fabric, int motions, double duration_s, double tolerance_m) {
  namespace spline = cloth::spline;
  SplineCase out;
  out.fabric = fabric;
  const spline::Swatch swatch;
  const cloth::Sheet triangles = cloth::make_sheet(geometry::make_grid_mesh(kSide_m, kSide_m, 33, 33));
  out.triangle_columns = 33;
  for (int motion = 0; motion < motions; ++motion) {
    Experiment e = motion_of(fabric.material, motion, duration_s);
    const spline::ChosenGrid chosen = spline::choose_grid(swatch, e, tolerance_m);
    const spline::SplineSheet sheet = spline::make_spline_sheet(swatch, chosen.grid),
                              fine = spline::make_spline_sheet(swatch, {halved(chosen.grid.u), halved(chosen.grid.v)});
    e.start_shape = chosen.rest.size() ? chosen.rest : spline::hung_shape(sheet, e, 1);
    // Both start in one fold: the reference from the chosen grid's rest, the chosen grid once more from the
    // reference's.
    Experiment r = e;
    r.start_shape = spline::settle(fine, r, spline::carried_over(sheet, e.start_shape, fine), 2e-6).position;
    r.starts_at_rest = false;
    const cloth::Trajectory reference = spline::simulate(fine, {r})[0];
    const Matrix3Xd seen = track_of(fine, reference);
    e.start_shape = spline::settle(sheet, e, spline::carried_over(fine, r.start_shape, sheet), 2e-6).position;
    e.starts_at_rest = false;
    Experiment pulled = e;
    pulled.guide = guide_to(seen, e.sample_s, markers_on(sheet));
    const cloth::Trajectory free = spline::simulate(sheet, {e})[0], held = spline::simulate(sheet, {pulled})[0];
    const double failed = std::numeric_limits<double>::infinity();
    out.free_mm.push_back(free.finite && reference.finite ? rms_mm(track_of(sheet, free), seen) : failed);
    out.pulled_mm.push_back(held.finite && reference.finite ? rms_mm(track_of(sheet, held), seen) : failed);
    Experiment t = motion_of(fabric.material, motion, duration_s);
    t.guide = guide_to(seen, e.sample_s, markers_on(triangles));
    t.start_shape = Matrix3Xd(3, triangles.data.vertex_count);
    for (Index i = 0; i < t.start_shape.cols(); ++i)
      t.start_shape.col(i) =
          position_of(spline::surface_point(fine, triangles.mesh.rest_uv[static_cast<size_t>(i)]), r.start_shape);
    out.triangles_mm.push_back(triangles_mm(triangles, t, seen, motion == 0 ? &out.triangle_cost : nullptr));
    if (motion > 0) continue;
    out.grid = chosen;
    out.columns = sheet.columns();
    out.rows = sheet.rows();
    out.cost = batch_cost(sheet, e);
  }
  return out;
}

}  // namespace selvedge::cli
