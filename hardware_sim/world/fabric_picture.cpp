#include "hardware_sim/world/fabric_picture.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "render/stripe_renderer.h"

namespace selvedge::hardware_sim {

namespace {

constexpr int kPerMirror = 8;

// The same camera with pixels of half the size: four of them fill one pixel.
geometry::Projection fine_camera(const geometry::Projection& camera) {
  geometry::Projection fine = camera;
  Eigen::Matrix3d scale;
  scale << 2, 0, 0.5, 0, 2, 0.5, 0, 0, 1;
  fine.matrix = scale * camera.matrix;
  fine.width_px = 2 * camera.width_px;
  fine.height_px = 2 * camera.height_px;
  return fine;
}

}  // namespace

std::vector<float> blurred_profile(const projector::Pattern& pattern, int mirrors, int per_mirror, double blur_px) {
  const bool rows = pattern.orientation == projector::Orientation::horizontal;
  cv::Mat line(1, mirrors * per_mirror, CV_32F);
  for (int i = 0; i < line.cols; ++i) {
    const double mirror = i / per_mirror;
    line.at<float>(i) =
        float(rows ? projector::brightness(pattern, 0, mirror) : projector::brightness(pattern, mirror, 0));
  }
  if (blur_px > 0) cv::GaussianBlur(line, line, {}, blur_px * per_mirror, 1e-6, cv::BORDER_REPLICATE);
  return {line.ptr<float>(), line.ptr<float>() + line.cols};
}

FabricPicture::FabricPicture(const geometry::Projection& camera, const geometry::Projection& projector,
                             const PictureOptions& options)
    : camera_(camera), projector_(projector), options_(options), eye_(geometry::centre(camera)),
      lamp_(geometry::centre(projector)), map_(camera, projector), fine_(fine_camera(camera), projector),
      from_projector_(projector, projector) {
  set_pattern({});
}

void FabricPicture::set_pattern(const projector::Pattern& pattern) {
  pattern_ = pattern;
  horizontal_ = pattern.orientation == projector::Orientation::horizontal;
  profile_ = blurred_profile(pattern, horizontal_ ? projector_.height_px : projector_.width_px, kPerMirror,
                             options_.projector_blur_px);
}

float FabricPicture::shown(float column_px, float row_px) const {
  if (column_px < -0.5f || row_px < -0.5f || column_px > projector_.width_px - 0.5f ||
      row_px > projector_.height_px - 0.5f)
    return 0;
  const float at = ((horizontal_ ? row_px : column_px) + 0.5f) * kPerMirror - 0.5f;
  const int last = int(profile_.size()) - 1, i = std::clamp(int(std::floor(at)), 0, last);
  const float share = std::clamp(at - float(i), 0.0f, 1.0f);
  return (1 - share) * profile_[i] + share * profile_[std::min(i + 1, last)];
}

float FabricPicture::fabric_grey(float column_px, float row_px, float projector_depth_m, float facing) const {
  float light = 0;
  if (facing > 0) {
    light = facing * shown(column_px, row_px);
    const int c = int(std::lround(column_px)), r = int(std::lround(row_px));
    if (light > 0 && c >= 0 && r >= 0 && c < projector_.width_px && r < projector_.height_px) {
      const float first = shadow_depth_[size_t(r) * projector_.width_px + c];
      if (projector_depth_m > first + float(options_.shadow_bias_m)) light = 0;  // false where NaN
    }
  }
  return float(options_.ambient_grey) + float(options_.lit_grey - options_.ambient_grey) * light;
}

const std::vector<float>& FabricPicture::take(const Eigen::Matrix3Xd& position,
                                              const std::vector<std::array<int, 3>>& triangles,
                                              const projector::Pattern& pattern) {
  if (!(pattern == pattern_)) set_pattern(pattern);
  map_.rasterise(position, triangles);
  fine_.rasterise(position, triangles);
  from_projector_.rasterise(position, triangles);
  from_projector_.fill(shadow_row_, shadow_column_, shadow_depth_);

  // Lambert's factor at the vertices; none where lamp and camera are on opposite sides of the fabric.
  const Eigen::Matrix3Xd normals = render::vertex_normals(position, triangles);
  std::vector<float> facing(position.cols());
  for (Eigen::Index i = 0; i < position.cols(); ++i) {
    const Eigen::Vector3d n = normals.col(i), p = position.col(i);
    const double to_lamp = n.dot((lamp_ - p).normalized()), to_eye = n.dot(eye_ - p);
    facing[i] = float(to_eye > 0 ? to_lamp : -to_lamp);
  }
  map_.fill(row_, column_, depth_);
  map_.fill_projector_depth(light_depth_);
  map_.fill_quantity(triangles, facing, facing_);

  const int width = camera_.width_px, height = camera_.height_px;
  grey_.assign(size_t(width) * height, float(options_.background_grey));
  const render::RowMap::Box box = fine_.covered();
  const std::vector<int>& fine = fine_.triangle_ids();
  for (int y = box.top / 2; y < std::min(height, (box.bottom + 1) / 2); ++y)
    for (int x = box.left / 2; x < std::min(width, (box.right + 1) / 2); ++x) {
      const size_t at = size_t(y) * width + x, sub = size_t(2 * y) * 2 * width + 2 * x;
      const int covered =
          (fine[sub] >= 0) + (fine[sub + 1] >= 0) + (fine[sub + 2 * width] >= 0) + (fine[sub + 2 * width + 1] >= 0);
      if (covered == 0) continue;
      float grey;
      if (!std::isnan(row_[at])) {
        grey = fabric_grey(column_[at], row_[at], light_depth_[at], facing_[at]);
      } else {
        // The pixel's centre is beside the fabric: one of its covered quarters tells.
        const auto sample = fine_.at({2 * x + 0.5, 2 * y + 0.5});
        if (!sample) continue;
        float turned = 0;
        for (int k = 0; k < 3; ++k) turned += float(sample->weights[k]) * facing[triangles[sample->triangle][k]];
        grey = fabric_grey(float(sample->column_px), float(sample->row_px), 0, turned);
      }
      grey_[at] += 0.25f * covered * (grey - grey_[at]);
    }
  blur();
  return grey_;
}

void FabricPicture::blur() {
  if (options_.camera_blur_px <= 0) return;
  const render::RowMap::Box box = map_.covered();
  const int reach = int(std::ceil(3 * options_.camera_blur_px));
  const cv::Rect whole(0, 0, camera_.width_px, camera_.height_px);
  const cv::Rect part =
      cv::Rect(box.left - reach, box.top - reach, box.right - box.left + 2 * reach, box.bottom - box.top + 2 * reach) &
      whole;
  if (part.empty()) return;
  cv::Mat view(camera_.height_px, camera_.width_px, CV_32F, grey_.data());
  cv::Mat piece = view(part).clone();
  cv::GaussianBlur(piece, piece, {2 * reach + 1, 2 * reach + 1}, options_.camera_blur_px, options_.camera_blur_px,
                   cv::BORDER_REPLICATE);
  piece.copyTo(view(part));
}

}  // namespace selvedge::hardware_sim
