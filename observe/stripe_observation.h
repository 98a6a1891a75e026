// What a recorded frame says in measurable terms: sub-pixel edges of the projected stripes, each with the
// projector row that it must be, and sub-pixel points of the silhouette.
//
// An edge is where grey crosses half-way between the plateaus of two neighbouring stripes, found along the
// image axis that runs most across the stripes (columns for horizontal stripes). Going towards growing projector
// row, dark to bright is a border of even half index and bright to dark one of odd (render/stripe_pattern.h:
// border_px). Standard deviations: σ_grey / |slope|, and what the half-way rule is off by.
// Which k: edges of neighbouring scan lines are linked into curves; curves that follow one another on a scan
// line differ by one edge; the held corners, whose positions are known, say where the counting starts
// (label_edges). Only curves that every path from the corners agrees on are labelled.
// Units: px in the image and the projector, grey levels.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "observe/silhouette.h"
#include "geometry/projection.h"
#include "render/stripe_pattern.h"

namespace selvedge::observe {

using render::StripePattern;

struct StripeEdge {
  Eigen::Vector2d pixel;   // of the recorded (distorted) image
  bool rising = false;     // dark to bright with growing projector row
  double sd_px = 0;        // of the position along the scan axis
  double rows_per_px = 0;  // projector px a camera px along the scan axis, from the neighbouring edges
  int run = 0;             // edges of one unbroken stretch of fabric on one scan line share it
  int curve = -1;          // edges of one connected stripe border share it
  bool labelled = false;
  int half_index = 0;       // even for rising, odd for falling; valid where labelled
  double projector_px = 0;  // row of that border (a column for vertical stripes); valid where labelled
};

struct StripeObservation {
  std::vector<StripeEdge> edges;
  std::vector<SilhouettePoint> silhouette;
  std::vector<unsigned char> inside;  // recorded silhouette A, row major
  double noise_grey = 0;              // of the background, grey levels
  bool scans_columns = true;          // edges were sought along image columns; else along rows
  int scan_sign = 1;                  // +1: projector row grows along the scan axis
  int curves = 0;
  double period_px = 0;  // of the pattern
};

// Everything but the labels.
StripeObservation observe_stripes(const Image& image, const geometry::Projection& camera,
                                  const geometry::Projection& projector, const StripePattern& pattern);

// Gives edges of one stripe border on neighbouring scan lines a common `curve`; `observe_stripes` has done it.
void link_curves(StripeObservation& observation);

// Labels the edges from the held corners' positions (m). Returns how many edges got a label.
int label_edges(StripeObservation& observation, const geometry::Projection& camera,
                const geometry::Projection& projector, const StripePattern& pattern, const Eigen::Vector3d& left_corner,
                const Eigen::Vector3d& right_corner);

// The point of the fabric that a labelled edge was seen at: camera ray through the pixel meets the plane of
// the projector row (projector distortion ignored there). nullopt where the two are nearly parallel.
std::optional<Eigen::Vector3d> triangulate(const geometry::Projection& camera, const geometry::Projection& projector,
                                           const StripePattern& pattern, const Eigen::Vector2d& pixel,
                                           double projector_px);

}  // namespace selvedge::observe
