// What is seen of a draped disc: its silhouette from any side, as a picture and as an outline.
//
// The silhouette is the union of fabric and support, so that an overhanging fold hides what is below it and fabric that
// hangs further in than the support's rim does not show. Outlines are where grey crosses a level half way, between the
// pixels (marching squares: Lorensen & Cline 1987, in a plane). m, anticlockwise.
#pragma once

#include "capture/trial/grey_png.h"
#include "material_tests/disc_sheet.h"

namespace selvedge::material_tests {

// Where pictures lie: the support's centre in pixels (column to the right, row downwards) and the scale.
struct PictureScale {
  double centre_column_px = 0, centre_row_px = 0, px_per_m = 0;
};

struct Silhouette {
  trial::GreyImage image;  // 255 where there is nothing, 0 where fabric or support is; y points up
  PictureScale scale;
};

// As a camera far away along `towards` (a unit vector from the fabric to the camera) sees it; (0, 0, 1): from above, x
// to the right.
Silhouette silhouette_of(const DiscSheet& sheet, const Eigen::Matrix3Xd& control,
                         const Eigen::Vector3d& towards = Eigen::Vector3d(0, 0, 1), double px_per_m = 2000);

// The longest closed outline about what is darker than half way between the picture's darkest and lightest hundredth;
// 2×N, m about the centre, y up. Throws std::runtime_error where picture and fabric cannot be told apart, or the fabric
// touches the picture's edge.
Eigen::Matrix2Xd outline_of(const trial::GreyImage& image, const PictureScale& scale);

// Radius of the largest circle about any point that lies inside the outline, m.
struct Circle {
  Eigen::Vector2d centre;
  double radius_m;
};
Circle largest_inside(const Eigen::Matrix2Xd& outline);

}  // namespace selvedge::material_tests
