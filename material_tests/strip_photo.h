// The midline of a strip that hangs over a table's edge, from a photograph from the side.
//
// The strip, and a table where there is one, differ in grey from a plain ground. Uneven light is taken out by a smooth
// ground fitted to the picture's rim, and Otsu's threshold parts the rest. The edge is where the table, which goes down
// further than the strip is thick, ends; or it is given. From there the strip is followed across its width, pixel by
// pixel, to its tip. What lies level is the strip on the table where it is seen, else the picture's rows.
#pragma once

#include <filesystem>
#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace selvedge::material_tests {

struct PhotoOptions {
  double mm_per_px = 0;
  std::optional<Eigen::Vector2d> edge_px;  // of the table, where the strip leaves it; else it is looked for
};

struct StripInPhoto {
  Eigen::Matrix2Xd midline_m;  // 2×N: along (from the edge), down; the first at the edge, the last at the tip
  double overhang_m = 0;       // length of that line
  double thickness_px = 0, roll_deg = 0;
  Eigen::Vector2d edge_px;
  cv::Mat picture;  // 8-bit colour: the photograph with what was found drawn over it
};

// Throws BadInput naming the file: where it is no picture, shows no strip, or none whose edge can be seen.
StripInPhoto find_strip(const std::filesystem::path& photo, const PhotoOptions& options);

}  // namespace selvedge::material_tests
