#include "diagnose/mesh_error.h"

#include <cmath>
#include <numbers>
#include <optional>

#include <Eigen/Geometry>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Where a camera saw a row; of rows that are no depth nothing.
std::optional<Eigen::Vector2d> pixel_of(const model::ObservedTrial& trial, Index place) {
  if (!trial.stripes) return {};
  if (trial.markers) place -= 3 * trial.markers->position.cols();
  if (place < 0) return {};
  for (const observe::StripeFrame& frame : trial.stripes->frames) {
    if (place < static_cast<Index>(frame.depth.size())) return frame.depth[static_cast<size_t>(place)].pixel;
    if (place < frame.points()) return {};
    place -= frame.points();
  }
  return {};
}

// Of unit mean square over [0, 1].
double wave(long half_waves, double x) {
  return half_waves == 0 ? 1 : std::numbers::sqrt2 * std::cos(std::numbers::pi * static_cast<double>(half_waves) * x);
}

}  // namespace

MatrixXd mesh_error(const Protocol& protocol, const model::Simulation& simulation, const Windows& windows,
                    const VectorXd& grid) {
  std::vector<std::optional<Eigen::Vector2d>> pixels;
  Eigen::AlignedBox2d seen;
  double square = 0, count = 0;
  for (Index row = 0; row < windows.rows(); ++row) {
    pixels.push_back(pixel_of(simulation.trials()[windows.trial(row)], windows.place(row)));
    if (!pixels.back()) continue;
    seen.extend(*pixels.back());
    square += grid(row) * grid(row);
    ++count;
  }
  const long waves = protocol.mesh_waves;
  MatrixXd out = MatrixXd::Zero(windows.rows(), count > 0 ? waves * waves : 0);
  const double each_mm = std::sqrt(square / std::max(count, 1.0)) / static_cast<double>(waves);
  for (Index row = 0; row < out.rows() && count > 0; ++row) {
    const auto& pixel = pixels[static_cast<size_t>(row)];
    if (!pixel) continue;
    const Eigen::Vector2d at = (*pixel - seen.min()).cwiseQuotient(seen.sizes().cwiseMax(1));
    for (Index k = 0; k < out.cols(); ++k) out(row, k) = each_mm * wave(k / waves, at.x()) * wave(k % waves, at.y());
  }
  return out;
}

}  // namespace selvedge::diagnose
