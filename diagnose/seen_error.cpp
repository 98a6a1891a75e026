#include "diagnose/seen_error.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// What a row is of a camera's: a depth, a point of the outline, or neither.
struct SeenRow {
  const observe::DepthPoint* depth = nullptr;
  const observe::OutlinePoint* outline = nullptr;
};

SeenRow seen_row(const model::ObservedTrial& trial, Index place) {
  if (!trial.stripes) return {};
  if (trial.markers) place -= 3 * trial.markers->position.cols();
  if (place < 0) return {};
  for (const observe::StripeFrame& frame : trial.stripes->frames) {
    const auto depths = static_cast<Index>(frame.depth.size());
    if (place < depths) return {.depth = &frame.depth[static_cast<size_t>(place)]};
    if (place < frame.points()) return {.outline = &frame.outline[static_cast<size_t>(place - depths)]};
    place -= frame.points();
  }
  return {};
}

// Of unit mean square over [0, 1].
double wave(long half_waves, double x) {
  return half_waves == 0 ? 1 : std::numbers::sqrt2 * std::cos(std::numbers::pi * static_cast<double>(half_waves) * x);
}

// The rows that are depths, and what a finer grid changes of them.
struct SeenDepths {
  std::vector<const observe::DepthPoint*> points;  // a row; null: another
  double change_mm = 0;                            // root mean square
};

SeenDepths seen_depths(const model::Simulation& simulation, const Windows& windows, const VectorXd& grid) {
  SeenDepths out;
  double square = 0, count = 0;
  for (Index row = 0; row < windows.rows(); ++row) {
    out.points.push_back(seen_row(simulation.trials()[windows.trial(row)], windows.place(row)).depth);
    if (out.points.back() == nullptr) continue;
    square += grid(row) * grid(row);
    ++count;
  }
  out.change_mm = std::sqrt(square / std::max(count, 1.0));
  return out;
}

MatrixXd mesh_patterns(const Protocol& protocol, const SeenDepths& depths) {
  Eigen::AlignedBox2d seen;
  for (const observe::DepthPoint* point : depths.points)
    if (point != nullptr) seen.extend(point->pixel);
  const auto rows = static_cast<Index>(depths.points.size());
  if (seen.isEmpty()) return {rows, 0};
  const long waves = protocol.mesh_waves;
  MatrixXd out = MatrixXd::Zero(rows, waves * waves);
  const double each_mm = depths.change_mm / static_cast<double>(waves);
  for (Index row = 0; row < rows; ++row) {
    const observe::DepthPoint* point = depths.points[static_cast<size_t>(row)];
    if (point == nullptr) continue;
    const Eigen::Vector2d at = (point->pixel - seen.min()).cwiseQuotient(seen.sizes().cwiseMax(1));
    for (Index k = 0; k < out.cols(); ++k) out(row, k) = each_mm * wave(k / waves, at.x()) * wave(k % waves, at.y());
  }
  return out;
}

// Of outlines of clouds.
MatrixXd rim_error(const model::Simulation& simulation, const Windows& windows) {
  VectorXd out = VectorXd::Zero(windows.rows());
  for (Index row = 0; row < out.size(); ++row) {
    const model::ObservedTrial& trial = simulation.trials()[windows.trial(row)];
    if (!trial.stripes || !trial.stripes->of_cloud) continue;
    if (const auto* point = seen_row(trial, windows.place(row)).outline) out(row) = point->sd_mm;
  }
  return out.isZero(0) ? MatrixXd(out.size(), 0) : MatrixXd(out);
}

}  // namespace

SeenError seen_error(const Protocol& protocol, const model::Simulation& simulation, const Windows& windows,
                     const VectorXd& grid) {
  const SeenDepths depths = seen_depths(simulation, windows, grid);
  const MatrixXd mesh = mesh_patterns(protocol, depths), rim = rim_error(simulation, windows);
  SeenError out{MatrixXd(windows.rows(), mesh.cols() + rim.cols()), VectorXd::Zero(windows.rows())};
  out.lasting << mesh, rim;
  for (Index row = 0; row < windows.rows(); ++row)
    if (depths.points[static_cast<size_t>(row)] != nullptr) out.rough_mm(row) = depths.change_mm;
  return out;
}

}  // namespace selvedge::diagnose
