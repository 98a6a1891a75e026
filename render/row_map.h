// For every camera pixel: which point of the fabric it sees, and which projector row and column light it.
//
// A z-buffer over scanlines. With camera pixel (x, y) and vertex depths w, every quantity q that is affine on a
// triangle has q/w affine in (x, y); so 1/w and the projector's homogeneous coordinates are planes over the
// image, and row = (h₁/w) / (h₂/w) is exact at every position, between pixel centres too. Lens distortion of
// camera and projector is applied to the vertices (error of the chords: below 0.01 px at 10 px triangles).
// Pixels are centred on whole numbers. Triangles with a vertex behind the camera are not drawn.
// Units: px, m. A map is reused from frame to frame: only what the last frame covered is cleared.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "geometry/projection.h"

namespace selvedge::render {

// What the fabric shows at one (sub-)pixel.
struct RowSample {
  int triangle = -1;
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();       // barycentric, on the fabric
  double depth_m = 0;                                      // along the camera's optical axis
  double row_px = 0, column_px = 0;                        // projector
  Eigen::Vector2d row_gradient = Eigen::Vector2d::Zero();  // d row / d (x, y), projector px per camera px
  bool inside = true;  // false: the position lies up to a pixel outside the triangle, which is continued there
};

class RowMap {
 public:
  RowMap(const geometry::Projection& camera, const geometry::Projection& projector);

  // position: 3×N, m. The triangles are kept by value only as planes; position may be gone afterwards.
  void rasterise(const Eigen::Matrix3Xd& position, const std::vector<std::array<int, 3>>& triangles);

  int width_px() const { return width_; }
  int height_px() const { return height_; }

  // Index of the triangle seen at a pixel, −1 for background; row major.
  const std::vector<int>& triangle_ids() const { return ids_; }

  // Half-open box of pixels that the fabric may cover; empty box: all four 0.
  struct Box {
    int left = 0, top = 0, right = 0, bottom = 0;
  };
  Box covered() const { return box_; }

  // Sub-pixel look-up. nullopt where none of the four pixels around sees fabric.
  std::optional<RowSample> at(const Eigen::Vector2d& pixel) const;

  // Projector rows and columns and the depth of every pixel, row major; NaN where there is background.
  // Vectors are resized; the same ones may be handed in again and again.
  void fill(std::vector<float>& row_px, std::vector<float>& column_px, std::vector<float>& depth_m) const;

  // A quantity known at the vertices (one value a vertex), and the distance from the projector along its optical
  // axis (m); row major, NaN where there is background. triangles: those that were rasterised.
  void fill_quantity(const std::vector<std::array<int, 3>>& triangles, const std::vector<float>& per_vertex,
                     std::vector<float>& quantity) const;
  void fill_projector_depth(std::vector<float>& depth_m) const;

  // 1 where fabric is seen, 0 elsewhere; row major.
  void fill_silhouette(std::vector<unsigned char>& inside) const;

 private:
  // c + x·dx + y·dy over the image.
  struct Plane {
    double c = 0, dx = 0, dy = 0;
    double at(double x, double y) const { return c + x * dx + y * dy; }
  };
  struct Face {
    Plane edge[3];    // plain barycentric weights in the image
    Plane inverse_w;  // 1 / depth in units of the projection
    Plane projector[3];
    double vertex_inverse_w[3] = {0, 0, 0};
    bool drawn = false;
  };
  void set_up(Face& face, const std::array<int, 3>& corners) const;
  void scan(const Face& face, int id, const std::array<int, 3>& corners);
  RowSample sample(int id, const Eigen::Vector2d& pixel) const;

  geometry::Projection camera_, projector_;
  int width_ = 0, height_ = 0;
  double metres_per_w_ = 1;
  std::vector<int> ids_;
  std::vector<float> nearness_;  // 1/w of what is seen, 0 for background
  std::vector<Face> faces_;
  std::vector<Eigen::Vector3d> seen_;       // camera pixel and w of each vertex
  std::vector<Eigen::Vector3d> projected_;  // projector column·h₂, row·h₂, h₂ of each vertex
  Box box_;
};

}  // namespace selvedge::render
