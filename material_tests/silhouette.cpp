#include "material_tests/silhouette.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>

#include <Eigen/Geometry>

#include "geometry/polyline.h"

namespace selvedge::material_tests {

namespace {

using Eigen::Index;
using Eigen::Matrix2Xd;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using trial::GreyImage;

constexpr int kAround = 720, kAlong = 25;
constexpr double kBorder_m = 0.01;

void fill_triangle(GreyImage& image, std::array<Vector2d, 3> p) {
  const auto [low, high] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
  for (int row = std::max(0, int(std::ceil(low))); row <= std::min(int(image.rows()) - 1, int(std::floor(high)));
       ++row) {
    double left = INFINITY, right = -INFINITY;
    for (size_t i = 0; i < 3; ++i) {
      const Vector2d &a = p[i], &b = p[(i + 1) % 3];
      if (std::min(a.y(), b.y()) > row || std::max(a.y(), b.y()) < row) continue;
      const double share = a.y() == b.y() ? 0 : (row - a.y()) / (b.y() - a.y());
      const double x = a.x() + share * (b.x() - a.x());
      left = std::min({left, x, a.y() == b.y() ? b.x() : x});
      right = std::max({right, x, a.y() == b.y() ? b.x() : x});
    }
    for (int c = std::max(0, int(std::ceil(left))); c <= std::min(int(image.cols()) - 1, int(std::floor(right))); ++c)
      image(row, c) = 0;
  }
}

// Grey level, 255 beyond the picture.
double grey(const GreyImage& image, Index row, Index column) {
  return row < 0 || column < 0 || row >= image.rows() || column >= image.cols() ? 255 : image(row, column);
}

double level_of(const GreyImage& image) {
  std::array<Index, 256> count{};
  for (Index i = 0; i < image.size(); ++i) ++count[image.data()[i]];
  const auto below = [&](double share) {
    Index sum = 0;
    size_t at = 0;
    while (at < 255 && (sum += count[at]) < share * static_cast<double>(image.size())) ++at;
    return static_cast<double>(at);
  };
  const double dark = below(0.01), light = below(0.99);
  if (light - dark < 40) throw std::runtime_error("fabric and background differ by less than 40 grey levels");
  return (dark + light) / 2;
}

// Outlines are walked along crossings of the edges between pixels: an edge is named by its pixel and direction.
using Edge = std::array<int, 3>;  // row, column, 0: to the right, 1: downwards

class Crossings {
 public:
  Crossings(const GreyImage& image, double level) : image_(image), level_(level) {
    for (int r = -1; r < image.rows(); ++r)
      for (int c = -1; c < image.cols(); ++c) add_cell(r, c);
  }
  // Points of the longest closed walk, (column, row).
  std::vector<Vector2d> longest() {
    std::vector<Vector2d> best;
    while (!next_.empty()) {
      std::vector<Vector2d> walk;
      Edge at = next_.begin()->first;
      for (auto step = next_.find(at); step != next_.end(); step = next_.find(at)) {
        walk.push_back(point(at));
        at = step->second;
        next_.erase(step);
      }
      if (walk.size() > best.size()) best = std::move(walk);
    }
    return best;
  }

 private:
  bool dark(int r, int c) const { return grey(image_, r, c) < level_; }
  Vector2d point(const Edge& e) const {
    const double a = grey(image_, e[0], e[1]), b = grey(image_, e[0] + (e[2] == 1), e[1] + (e[2] == 0));
    const double share = (level_ - a) / (b - a);
    return {e[1] + (e[2] == 0 ? share : 0), e[0] + (e[2] == 1 ? share : 0)};
  }
  // The four pixels (r, c) … (r+1, c+1): with dark on its left hand, from where the outline comes to where it goes.
  void add_cell(int r, int c) {
    const std::array<Edge, 4> edge = {Edge{r, c, 0}, Edge{r, c + 1, 1}, Edge{r + 1, c, 0}, Edge{r, c, 1}};  // clockwise
    const std::array<bool, 4> in = {dark(r, c), dark(r, c + 1), dark(r + 1, c + 1), dark(r + 1, c)};
    // Between corner i and i + 1 lies edge i. Into the cell where dark gives way to light, clockwise; out at the next.
    for (size_t i = 0; i < 4; ++i) {
      if (!in[i] || in[(i + 1) % 4]) continue;
      size_t out = (i + 1) % 4;
      while (in[out] == in[(out + 1) % 4]) out = (out + 1) % 4;
      next_[edge[i]] = edge[out];
    }
  }
  const GreyImage& image_;
  const double level_;
  std::map<Edge, Edge> next_;
};

}  // namespace

Silhouette silhouette_of(const DiscSheet& sheet, const Matrix3Xd& control, const Vector3d& towards, double px_per_m) {
  const Eigen::Matrix3d view = Eigen::Quaterniond::FromTwoVectors(towards, Vector3d::UnitZ()).toRotationMatrix();
  const double half_m = sheet.disc().radius_m + kBorder_m;
  const int side = static_cast<int>(std::ceil(2 * half_m * px_per_m));
  Silhouette out{GreyImage::Constant(side, side, 255), {(side - 1) / 2.0, (side - 1) / 2.0, px_per_m}};
  const auto pixel = [&](const Vector3d& x) {
    const Vector3d seen = view * x;
    return Vector2d(out.scale.centre_column_px + px_per_m * seen.x(), out.scale.centre_row_px - px_per_m * seen.y());
  };
  const Matrix3Xd x = sheet.grid(control, kAround, kAlong);
  std::vector<Vector2d> seen;
  for (Index i = 0; i < x.cols(); ++i) seen.push_back(pixel(x.col(i)));
  const Vector2d middle = pixel(Vector3d::Zero());
  for (int j = 0; j < kAround; ++j) {
    const auto at = [&](int spoke, int k) { return seen[static_cast<size_t>((spoke % kAround) * kAlong + k)]; };
    fill_triangle(out.image, {middle, at(j, 0), at(j + 1, 0)});
    for (int k = 0; k + 1 < kAlong; ++k) {
      fill_triangle(out.image, {at(j, k), at(j, k + 1), at(j + 1, k)});
      fill_triangle(out.image, {at(j + 1, k), at(j, k + 1), at(j + 1, k + 1)});
    }
  }
  return out;
}

Matrix2Xd outline_of(const GreyImage& image, const PictureScale& scale) {
  const std::vector<Vector2d> walk = Crossings(image, level_of(image)).longest();
  if (walk.size() < 16) throw std::runtime_error("no outline was found");
  Matrix2Xd out(2, static_cast<Index>(walk.size()));
  for (size_t i = 0; i < walk.size(); ++i) {
    const Vector2d& p = walk[i];
    if (p.x() < 0 || p.y() < 0 || p.x() > double(image.cols() - 1) || p.y() > double(image.rows() - 1))
      throw std::runtime_error("the fabric reaches the picture's edge");
    out.col(static_cast<Index>(i)) =
        Vector2d(p.x() - scale.centre_column_px, scale.centre_row_px - p.y()) / scale.px_per_m;
  }
  if (geometry::polygon_area(out) < 0) out = out.rowwise().reverse().eval();
  return out;
}

Circle largest_inside(const Matrix2Xd& outline) {
  const auto room = [&](const Vector2d& at) { return (outline.colwise() - at).colwise().norm().minCoeff(); };
  Circle best{outline.rowwise().mean(), 0};
  best.radius_m = room(best.centre);
  for (double step = best.radius_m / 8; step > 1e-6; step /= 2)
    for (bool better = true; better;) {
      better = false;
      for (const Vector2d& way : {Vector2d(1, 0), Vector2d(-1, 0), Vector2d(0, 1), Vector2d(0, -1)})
        if (const double r = room(best.centre + step * way); r > best.radius_m) {
          best = {best.centre + step * way, r};
          better = true;
        }
    }
  return best;
}

}  // namespace selvedge::material_tests
