// What instruments measure of a fabric, as trials hold it: a strip bent by its weight, a disc draped over a support, a
// strip pulled. Plain data in SI units. Source of names and units: docs/formats.md, "Material tests".
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace selvedge::trial {

// A strip pushed over a horizontal edge (ISO 9073-7, ASTM D1388), its length at angle_deg from the warp.
struct Cantilever {
  double angle_deg = 0;                    // 0: the strip runs along the warp and bends as the warp does; 90: weft
  double overhang_m = 0;                   // length of strip beyond the edge
  std::optional<double> bending_length_m;  // as the instrument gives it: half the overhang whose tip is 41.5° down
  Eigen::Matrix2Xd midline_m;              // midline.csv: along (horizontal, from the edge), down; empty where none
};

// One capture of a disc's outline from above, m, about the support's centre, anticlockwise; 2×N, the last point is
// joined to the first.
struct Outline {
  int capture = 0;
  Eigen::Matrix2Xd point_m;
};

// A disc of fabric centred on a smaller round support (ISO 9073-9, Cusick 1968); x runs along the warp.
struct Cusick {
  double disc_m = 0, support_m = 0;  // diameters
  std::vector<Outline> outlines;     // outline.csv
};

// One pull of a strip; stretch is length over rest length (1 at rest), across NaN where it was not tracked.
struct Pull {
  int number = 0;
  std::vector<double> time_s, force, stretch_along, stretch_across;
};

// A strip pulled along its length, at angle_deg from the warp.
struct Tensile {
  double angle_deg = 0;
  double width_m = 0, length_m = 0;  // at rest; length of the gauge whose stretch is measured
  std::string force_unit = "N";      // of Pull::force, as recorded
  std::vector<Pull> pulls;           // pull.csv
};

}  // namespace selvedge::trial
