#include "calib/device_drawings.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace selvedge::calib {

namespace {

constexpr int kWidth = 640;

// Opens an SVG in the device's pixels, drawn kWidth wide.
std::string open_svg(const ImageSize& size) {
  const int height = kWidth * size.height_px / size.width_px;
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" viewBox=\"-0.5 -0.5 {} {}\">"
      "<rect x=\"-0.5\" y=\"-0.5\" width=\"{}\" height=\"{}\" fill=\"#fff\" stroke=\"#111\" stroke-width=\"2\"/>",
      kWidth, height, size.width_px, size.height_px, size.width_px, size.height_px);
}

// Length in image pixels that shows as one pixel of the picture.
double unit(const ImageSize& size) { return static_cast<double>(size.width_px) / kWidth; }

std::string line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const char* colour, double width) {
  return fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-width=\"{:.1f}\"/>", a.x(),
      a.y(), b.x(), b.y(), colour, width);
}

std::string circle(const Eigen::Vector2d& at, double radius, const char* fill, const char* stroke, double width) {
  return fmt::format(
      "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"{:.1f}\"/>", at.x(),
      at.y(), radius, fill, stroke, width);
}

std::string text(const Eigen::Vector2d& at, double size, const std::string& words, const char* colour = "#111") {
  return fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{:.1f}\" text-anchor=\"middle\" font-family=\"sans-serif\" "
      "fill=\"{}\">{}</text>",
      at.x(), at.y(), size, colour, words);
}

// Outline of the points' convex hull; dash: of the line, in image px, none where empty.
std::string hull(const std::vector<Eigen::Vector2d>& points, const char* colour, double width,
                 const std::string& dash) {
  if (points.size() < 3) return "";
  std::vector<cv::Point2f> given, outer;
  for (const auto& p : points) given.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  cv::convexHull(given, outer);
  std::string places;
  for (const auto& p : outer) places += fmt::format("{:.1f},{:.1f} ", p.x, p.y);
  return fmt::format("<polygon points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:.1f}\"{}/>", places, colour,
                     width, dash.empty() ? "" : fmt::format(" stroke-dasharray=\"{}\"", dash));
}

// Edges of the fabric's volume in the image.
std::string volume_outline(const DeviceSolution& d, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  std::string svg;
  for (int a = 0; a < 8; ++a)
    for (int axis = 0; axis < 3; ++axis) {
      const int b = a | (1 << axis);
      if (b == a) continue;
      const auto corner = [&](int bits) {
        Eigen::Vector3d p;
        for (int i = 0; i < 3; ++i) p[i] = (bits >> i) & 1 ? high[i] : low[i];
        return p;
      };
      if (depth_of(d.refined.camera, corner(a)) <= 0 || depth_of(d.refined.camera, corner(b)) <= 0) continue;
      svg += line(pixel_of(d.refined.camera, corner(a)), pixel_of(d.refined.camera, corner(b)), "#888", unit(d.size));
    }
  return svg;
}

}  // namespace

double residual_magnification(const DeviceSolution& d) {
  const double wanted = 12 * unit(d.size) / std::max(d.rms_px, 1e-9);
  double chosen = 1;
  for (const double step : {2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0})
    if (step <= wanted) chosen = step;
  return chosen;
}

std::string draw_residuals(const DeviceSolution& d, double magnification) {
  const double u = unit(d.size);
  std::string svg = open_svg(d.size);
  for (size_t i = 0; i < d.seen().size(); ++i) {
    const Sighting& s = d.seen()[i];
    if (!d.input.used[i]) {
      const Eigen::Vector2d arm(4 * u, 4 * u), other(4 * u, -4 * u);
      svg +=
          line(s.pixel - arm, s.pixel + arm, "#b00", 1.5 * u) + line(s.pixel - other, s.pixel + other, "#b00", 1.5 * u);
      continue;
    }
    const Eigen::Vector2d expected =
        pixel_of(d.refined.camera, s.point, shift_for(d.refined, d.input.stage_starts, s.pose));
    svg += circle(expected, 1.6 * u, "#111", "none", 0) +
           line(expected, expected + magnification * (s.pixel - expected), "#06c", 1.2 * u);
  }
  return svg + "</svg>";
}

std::string draw_deviation(const DeviceSolution& d, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  const int columns = 10;
  const double cell = static_cast<double>(d.size.width_px) / columns;
  const int rows = std::max(1, static_cast<int>(std::lround(d.size.height_px / cell)));
  const double middle_depth = depth_of(d.refined.camera, (low + high) / 2);
  const geometry::Projection projection = to_projection(d.refined.camera, d.size);
  const Eigen::Vector3d centre = geometry::centre(projection);
  std::string svg = open_svg(d.size);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector2d at((column + 0.5) * cell, (row + 0.5) * d.size.height_px / rows);
      const Eigen::Vector3d direction = geometry::ray(projection, at);
      const double along = depth_of(d.refined.camera, centre + direction);
      const Eigen::Vector3d point = centre + direction * middle_depth / along;
      const double sd = std::sqrt(pixel_sd(d.refined.camera, d.uncertainty.covariance, point).squaredNorm() / 2);
      // White at 0, full at 0.5 px; the figure stands in every cell as well.
      const int shade = 255 - static_cast<int>(std::lround(155 * std::min(sd / 0.5, 1.0)));
      svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"rgb(255,{},{})\"/>",
                         column * cell, row * static_cast<double>(d.size.height_px) / rows, cell,
                         static_cast<double>(d.size.height_px) / rows, shade, shade);
      svg += text(at, 0.26 * cell, sd < 99 ? fmt::format("{:.2f}", sd) : "-");
    }
  return svg + volume_outline(d, low, high) + "</svg>";
}

std::string draw_coverage(const DeviceSolution& d, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                          const std::vector<Eigen::Vector3d>& next_markers) {
  static const char* const colours[] = {"#06c", "#c60", "#080", "#a0a", "#066", "#630"};
  const double u = unit(d.size);
  const std::vector<int> poses = poses_of(d.seen());
  std::string svg = open_svg(d.size) + volume_outline(d, low, high);
  for (size_t p = 0; p < poses.size(); ++p) {
    std::vector<Eigen::Vector2d> markers;
    for (size_t i = 0; i < d.seen().size(); ++i)
      if (d.seen()[i].pose == poses[p] && d.input.used[i]) markers.push_back(d.seen()[i].pixel);
    for (const auto& marker : markers) svg += circle(marker, 1.6 * u, colours[p % 6], "none", 0);
    svg += hull(markers, colours[p % 6], 0.8 * u, "");
    if (markers.empty()) continue;
    // The number stands at the corner towards the top left.
    const auto corner = *std::min_element(markers.begin(), markers.end(),
                                          [](const auto& x, const auto& y) { return x.sum() < y.sum(); });
    svg += text(corner - Eigen::Vector2d(7 * u, 3 * u), 14 * u, std::to_string(poses[p]), colours[p % 6]);
  }
  std::vector<Eigen::Vector2d> next;
  for (const Eigen::Vector3d& marker : next_markers) {
    if (depth_of(d.refined.camera, marker) <= 0) continue;
    next.push_back(pixel_of(d.refined.camera, marker));
    svg += circle(next.back(), 5 * u, "none", "#b00", 2 * u);
  }
  return svg + hull(next, "#b00", 2 * u, fmt::format("{:.0f} {:.0f}", 8 * u, 5 * u)) + "</svg>";
}

}  // namespace selvedge::calib
