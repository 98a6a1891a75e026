#include "render/row_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/fast_projection.h"

namespace selvedge::render {

RowMap::RowMap(const geometry::Projection& camera, const geometry::Projection& projector)
    : camera_(camera), projector_(projector), width_(camera.width_px), height_(camera.height_px) {
  metres_per_w_ = 1 / camera.matrix.row(2).head<3>().norm();
  if (camera.matrix.leftCols<3>().determinant() < 0) camera_.matrix *= -1;
  if (projector.matrix.leftCols<3>().determinant() < 0) projector_.matrix *= -1;
  ids_.assign(size_t(width_) * height_, -1);
  nearness_.assign(size_t(width_) * height_, 0.0f);
}

void RowMap::rasterise(const Eigen::Matrix3Xd& position, const std::vector<std::array<int, 3>>& triangles) {
  for (int y = box_.top; y < box_.bottom; ++y) {
    const size_t start = size_t(y) * width_ + box_.left;
    std::fill_n(ids_.begin() + start, box_.right - box_.left, -1);
    std::fill_n(nearness_.begin() + start, box_.right - box_.left, 0.0f);
  }
  box_ = {width_, height_, 0, 0};

  const FastProjection camera(camera_), projector(projector_);
  seen_.resize(position.cols());
  projected_.resize(position.cols());
  for (Eigen::Index i = 0; i < position.cols(); ++i) {
    seen_[i] = camera(position.col(i));
    const Eigen::Vector3d lit = projector(position.col(i));
    projected_[i] = {lit.x() * lit.z(), lit.y() * lit.z(), lit.z()};
  }

  faces_.resize(triangles.size());
  for (size_t i = 0; i < triangles.size(); ++i) {
    set_up(faces_[i], triangles[i]);
    if (faces_[i].drawn) scan(faces_[i], int(i), triangles[i]);
  }
  if (box_.left >= box_.right || box_.top >= box_.bottom) box_ = {};
}

void RowMap::set_up(Face& face, const std::array<int, 3>& corners) const {
  const Eigen::Vector3d& a = seen_[corners[0]];
  const Eigen::Vector3d& b = seen_[corners[1]];
  const Eigen::Vector3d& c = seen_[corners[2]];
  const double area = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
  face.drawn = a.z() > 0 && b.z() > 0 && c.z() > 0 && std::abs(area) > 1e-9;
  if (!face.drawn) return;

  const Eigen::Vector3d* v[3] = {&a, &b, &c};
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d& p = *v[(i + 1) % 3];
    const Eigen::Vector3d& q = *v[(i + 2) % 3];
    Plane& plane = face.edge[i];
    plane.dx = (p.y() - q.y()) / area;
    plane.dy = (q.x() - p.x()) / area;
    plane.c = (p.x() * q.y() - q.x() * p.y()) / area;
    face.vertex_inverse_w[i] = 1 / v[i]->z();
  }
  const auto combine = [&](double fa, double fb, double fc) {
    return Plane{fa * face.edge[0].c + fb * face.edge[1].c + fc * face.edge[2].c,
                 fa * face.edge[0].dx + fb * face.edge[1].dx + fc * face.edge[2].dx,
                 fa * face.edge[0].dy + fb * face.edge[1].dy + fc * face.edge[2].dy};
  };
  const double* iw = face.vertex_inverse_w;
  face.inverse_w = combine(iw[0], iw[1], iw[2]);
  for (int k = 0; k < 3; ++k)
    face.projector[k] = combine(iw[0] * projected_[corners[0]][k], iw[1] * projected_[corners[1]][k],
                                iw[2] * projected_[corners[2]][k]);
}

void RowMap::scan(const Face& face, int id, const std::array<int, 3>& corners) {
  const Eigen::Vector3d& a = seen_[corners[0]];
  const Eigen::Vector3d& b = seen_[corners[1]];
  const Eigen::Vector3d& c = seen_[corners[2]];
  const double slack = 1e-9;  // a pixel on a shared edge belongs to both triangles: no pinholes
  const double low_x = std::min({a.x(), b.x(), c.x()}), high_x = std::max({a.x(), b.x(), c.x()});
  const double low_y = std::min({a.y(), b.y(), c.y()}), high_y = std::max({a.y(), b.y(), c.y()});
  if (high_x < 0 || high_y < 0 || low_x > width_ - 1 || low_y > height_ - 1) return;
  const int top = std::max(0, int(std::ceil(low_y - slack)));
  const int bottom = std::min(height_ - 1, int(std::floor(high_y + slack)));
  const int left_most = std::max(0, int(std::ceil(low_x - slack)));
  const int right_most = std::min(width_ - 1, int(std::floor(high_x + slack)));

  for (int y = top; y <= bottom; ++y) {
    double left = left_most, right = right_most;
    for (const Plane& edge : face.edge) {
      const double rest = edge.c + slack + y * edge.dy;
      if (edge.dx > 0) left = std::max(left, -rest / edge.dx);
      else if (edge.dx < 0) right = std::min(right, -rest / edge.dx);
      else if (rest < 0) right = -1;
    }
    if (left > right) continue;
    const int first = int(std::ceil(left)), last = int(std::floor(right));
    if (first > last) continue;
    box_.left = std::min(box_.left, first);
    box_.right = std::max(box_.right, last + 1);
    box_.top = std::min(box_.top, y);
    box_.bottom = std::max(box_.bottom, y + 1);
    int* ids = ids_.data() + size_t(y) * width_;
    float* nearness = nearness_.data() + size_t(y) * width_;
    const double base = face.inverse_w.c + y * face.inverse_w.dy;
    for (int x = first; x <= last; ++x) {
      const float near = float(base + x * face.inverse_w.dx);
      if (near > nearness[x]) {
        nearness[x] = near;
        ids[x] = id;
      }
    }
  }
}

RowSample RowMap::sample(int id, const Eigen::Vector2d& pixel) const {
  const Face& face = faces_[id];
  const double x = pixel.x(), y = pixel.y();
  const double inverse_w = face.inverse_w.at(x, y);
  RowSample result;
  result.triangle = id;
  for (int i = 0; i < 3; ++i) result.weights[i] = face.edge[i].at(x, y) * face.vertex_inverse_w[i] / inverse_w;
  result.depth_m = metres_per_w_ / inverse_w;
  const double h2 = face.projector[2].at(x, y);
  result.column_px = face.projector[0].at(x, y) / h2;
  result.row_px = face.projector[1].at(x, y) / h2;
  result.row_gradient = {(face.projector[1].dx - result.row_px * face.projector[2].dx) / h2,
                         (face.projector[1].dy - result.row_px * face.projector[2].dy) / h2};
  return result;
}

std::optional<RowSample> RowMap::at(const Eigen::Vector2d& pixel) const {
  // The triangles of the four pixels around: the one that holds the position and is nearest wins; where
  // none holds it (at the outline), the one that misses it least is continued.
  const int x0 = int(std::floor(pixel.x())), y0 = int(std::floor(pixel.y()));
  int best = -1;
  double best_miss = std::numeric_limits<double>::infinity(), best_nearness = 0;
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx) {
      const int x = x0 + dx, y = y0 + dy;
      if (x < 0 || y < 0 || x >= width_ || y >= height_) continue;
      const int id = ids_[size_t(y) * width_ + x];
      if (id < 0 || id == best) continue;
      const Face& face = faces_[id];
      double miss = 0;
      for (const Plane& edge : face.edge) {
        // In pixels rather than as a share of the triangle, so that slivers do not look near.
        const double weight = edge.at(pixel.x(), pixel.y());
        if (weight < 0) miss = std::max(miss, -weight / std::hypot(edge.dx, edge.dy));
      }
      if (miss < 1e-9) miss = 0;
      const double nearness = face.inverse_w.at(pixel.x(), pixel.y());
      if (miss < best_miss || (miss == best_miss && nearness > best_nearness)) {
        best = id;
        best_miss = miss;
        best_nearness = nearness;
      }
    }
  if (best < 0) return std::nullopt;
  RowSample result = sample(best, pixel);
  result.inside = best_miss == 0;
  return result;
}

void RowMap::fill(std::vector<float>& row_px, std::vector<float>& column_px, std::vector<float>& depth_m) const {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const size_t count = ids_.size();
  row_px.assign(count, nan);
  column_px.assign(count, nan);
  depth_m.assign(count, nan);
  const float metres = float(metres_per_w_);
  for (int y = box_.top; y < box_.bottom; ++y)
    for (int x = box_.left; x < box_.right; ++x) {
      const size_t i = size_t(y) * width_ + x;
      if (ids_[i] < 0) continue;
      const Face& face = faces_[ids_[i]];
      const double inverse_h2 = 1 / face.projector[2].at(x, y);
      column_px[i] = float(face.projector[0].at(x, y) * inverse_h2);
      row_px[i] = float(face.projector[1].at(x, y) * inverse_h2);
      depth_m[i] = metres / nearness_[i];
    }
}

void RowMap::fill_quantity(const std::vector<std::array<int, 3>>& triangles, const std::vector<float>& per_vertex,
                           std::vector<float>& quantity) const {
  quantity.assign(ids_.size(), std::numeric_limits<float>::quiet_NaN());
  for (int y = box_.top; y < box_.bottom; ++y)
    for (int x = box_.left; x < box_.right; ++x) {
      const size_t i = size_t(y) * width_ + x;
      if (ids_[i] < 0) continue;
      const Face& face = faces_[ids_[i]];
      double sum = 0;
      for (int k = 0; k < 3; ++k)
        sum += face.edge[k].at(x, y) * face.vertex_inverse_w[k] * per_vertex[triangles[ids_[i]][k]];
      quantity[i] = float(sum / nearness_[i]);
    }
}

void RowMap::fill_projector_depth(std::vector<float>& depth_m) const {
  depth_m.assign(ids_.size(), std::numeric_limits<float>::quiet_NaN());
  const double metres = 1 / projector_.matrix.row(2).head<3>().norm();
  for (int y = box_.top; y < box_.bottom; ++y)
    for (int x = box_.left; x < box_.right; ++x) {
      const size_t i = size_t(y) * width_ + x;
      if (ids_[i] >= 0) depth_m[i] = float(metres * faces_[ids_[i]].projector[2].at(x, y) / nearness_[i]);
    }
}

void RowMap::fill_silhouette(std::vector<unsigned char>& inside) const {
  inside.assign(ids_.size(), 0);
  for (int y = box_.top; y < box_.bottom; ++y)
    for (int x = box_.left; x < box_.right; ++x) {
      const size_t i = size_t(y) * width_ + x;
      inside[i] = ids_[i] >= 0;
    }
}

}  // namespace selvedge::render
