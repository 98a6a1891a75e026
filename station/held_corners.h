// What one frame shows of the fabric's two held corners: where in the image they are, and which line of the projector
// lights them.
//
// In the image: the end of the fabric's side edge, a line fitted to sub-pixel outline points below the corner, followed
// up to where the silhouette ends. It is some tenths of a pixel off.
// From the stripes: the edges near the corner, each the border of a known projector row (or column), give by weighted
// least squares
//   line(p) = line₀ + g · (p − p₀),   weight exp(−|p − p₀|² / 2 w²)
// near the corner p₀. Stripes repeat, so line₀ is known up to whole periods; that nearest to what is expected is
// taken. px of the recorded image and of the projector.
#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include "calib/time_offset.h"
#include "capture/trial/trial.h"

namespace selvedge::station {

struct CornerOptions {
  double reach_px = 60;          // a corner further from where it should be is not sought
  double edge_px = 60;           // of the side edge below the corner
  double stripe_reach_px = 40;   // edges of stripes that tell the line at a corner,
  double stripe_weight_px = 15;  // w
};

using calib::LineMap;

struct HeldCorner {
  std::optional<Eigen::Vector2d> pixel;
  std::optional<LineMap> line;
};

using TrackedCorners = std::array<std::optional<Eigen::Vector3d>, 2>;  // left, right, m; none where hidden
using HeldCorners = std::array<HeldCorner, 2>;

// Looks for both corners in a frame of a trial that has a camera, and where it has a projector and stripes for the
// lines.
HeldCorners find_held_corners(const trial::Trial& trial, const trial::GreyImage& image, const TrackedCorners& tracked,
                              const CornerOptions& options = {});

// Where the held corner is in one frame; nullopt where it does not show that corner's side edge.
std::optional<Eigen::Vector2d> find_corner(const trial::GreyImage& image, const Eigen::Vector2d& expected, bool left,
                                           const CornerOptions& options = {});

}  // namespace selvedge::station
