#include "observe/stripe_observation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "geometry/cubic.h"
#include "geometry/order_statistics.h"

namespace selvedge::observe {

namespace {

// Two sub-pixel steps beyond the silhouette's own blur.
constexpr int kRimPx = 2;
constexpr double kEdgeSd_px = 0.03;    // what the half-way rule itself is off by
constexpr double kLeastContrast = 20;  // grey levels between the plateaus of neighbouring stripes

struct Extremum {
  int at = 0;
  double grey = 0;
  bool high = false;
};

// Alternating highs and lows of a run that differ by the least contrast; the run's ends are no extrema.
std::vector<Extremum> extrema(const std::vector<double>& line, int first, int last, double least_contrast) {
  std::vector<Extremum> found;
  int low = first, high = first;
  int direction = 0;  // +1: a rise was seen last
  for (int i = first; i <= last; ++i) {
    if (line[i] > line[high]) high = i;
    if (line[i] < line[low]) low = i;
    if (direction >= 0 && line[i] < line[high] - least_contrast) {
      if (high > first) found.push_back({high, line[high], true});
      direction = -1;
      low = i;
    } else if (direction <= 0 && line[i] > line[low] + least_contrast) {
      if (low > first) found.push_back({low, line[low], false});
      direction = 1;
      high = i;
    }
    if (direction > 0 && line[i] >= line[high]) high = i;
    if (direction < 0 && line[i] <= line[low]) low = i;
  }
  // What came last counts only where the run turned back from it a little.
  if (direction > 0 && high < last && line[high] - line[last] > 0.05 * least_contrast)
    found.push_back({high, line[high], true});
  if (direction < 0 && low < last && line[last] - line[low] > 0.05 * least_contrast)
    found.push_back({low, line[low], false});
  return found;
}

struct Crossing {
  double at, slope;
};

// Where the line crosses a level between two samples of opposite sides; Catmull-Rom cubic, bisection.
std::optional<Crossing> crossing(const std::vector<double>& line, int from, int to, double level) {
  const bool up = line[to] > line[from];
  for (int i = from; i < to; ++i) {
    if ((line[i] < level) == (line[i + 1] < level) || (line[i + 1] > line[i]) != up) continue;
    const double p0 = line[std::max(i - 1, 0)], p1 = line[i], p2 = line[i + 1],
                 p3 = line[std::min(i + 2, int(line.size()) - 1)];
    const auto cubic = [&](double t) { return geometry::catmull_rom(t, p0, p1, p2, p3); };
    double a = 0, b = 1;
    for (int k = 0; k < 30; ++k) {
      const double m = 0.5 * (a + b);
      ((cubic(m) < level) == (p1 < level) ? a : b) = m;
    }
    const double slope = (cubic(std::min(1.0, a + 0.05)) - cubic(std::max(0.0, a - 0.05))) /
                         (std::min(1.0, a + 0.05) - std::max(0.0, a - 0.05));
    return Crossing{i + a, std::abs(slope)};
  }
  return std::nullopt;
}

// +1 where the projector coordinate grows along the scan axis, for a plane through the nearest approach of both
// optical axes.
int scan_sign(const geometry::Projection& camera, const geometry::Projection& projector, bool horizontal,
              bool scans_columns) {
  const Eigen::Vector3d eye = geometry::centre(camera), lamp = geometry::centre(projector);
  const Eigen::Vector2d middle(0.5 * camera.width_px, 0.5 * camera.height_px);
  const Eigen::Vector3d axis = geometry::ray(camera, middle);
  const Eigen::Vector3d beam = geometry::ray(projector, {0.5 * projector.width_px, 0.5 * projector.height_px});
  // Nearest approach of eye + s·axis and lamp + t·beam.
  const double c = axis.dot(beam), denominator = 1 - c * c;
  const Eigen::Vector3d between = lamp - eye;
  double s = denominator > 1e-6 ? (between.dot(axis) - c * between.dot(beam)) / denominator : 1.0;
  if (!(s > 0.05)) s = 1.0;
  const Eigen::Vector2d step = scans_columns ? Eigen::Vector2d(0, 1) : Eigen::Vector2d(1, 0);
  const auto coordinate = [&](const Eigen::Vector2d& pixel) {
    const Eigen::Vector3d ray = geometry::ray(camera, pixel);
    const Eigen::Vector2d lit = geometry::project(projector, eye + ray * (s / ray.dot(axis)));
    return horizontal ? lit.y() : lit.x();
  };
  return coordinate(middle + step) >= coordinate(middle - step) ? 1 : -1;
}

// Sum of |∂I/∂y| inside against |∂I/∂x|: the axis that runs most across the stripes.
bool columns_run_across(const Image& image, const std::vector<unsigned char>& inside) {
  double along_x = 0, along_y = 0;
  for (int y = 1; y + 1 < image.rows(); y += 3)
    for (int x = 1; x + 1 < image.cols(); x += 3) {
      const size_t i = size_t(y) * image.cols() + x;
      if (!inside[i] || !inside[i - 1] || !inside[i + 1] || !inside[i - image.cols()] || !inside[i + image.cols()])
        continue;
      along_x += std::abs(image(y, x + 1) - image(y, x - 1));
      along_y += std::abs(image(y + 1, x) - image(y - 1, x));
    }
  return along_y >= along_x;
}

// One scan line being read: its grey levels, and where along it fabric is.
struct ScanLine {
  std::vector<double> grey;
  std::vector<unsigned char> inside;
};

void read_line(const Image& image, const std::vector<unsigned char>& inside, bool column, int index, ScanLine& line) {
  const int length = int(column ? image.rows() : image.cols());
  line.grey.resize(length);
  line.inside.resize(length);
  for (int i = 0; i < length; ++i) {
    const int y = column ? i : index, x = column ? index : i;
    line.grey[i] = image(y, x);
    line.inside[i] = inside[size_t(y) * image.cols() + x];
  }
}

// Projector px a camera px at each edge of a run, from the distances to the neighbours.
void set_scales(std::vector<StripeEdge>& edges, size_t from, bool columns, const StripePattern& pattern) {
  const size_t count = edges.size() - from;
  const auto along = [&](size_t i) { return columns ? edges[from + i].pixel.y() : edges[from + i].pixel.x(); };
  for (size_t i = 0; i < count; ++i) {
    const size_t a = i > 0 ? i - 1 : i, b = i + 1 < count ? i + 1 : i;
    if (b == a) continue;
    // Two neighbours span a whole period, one spans its bright or its dark part.
    double rows = pattern.period_px;
    if (b - a == 1) rows *= edges[from + a].rising ? pattern.duty : 1 - pattern.duty;
    edges[from + i].rows_per_px = rows / std::max(1e-6, along(b) - along(a));
  }
}

// At the median of the edges; 0 where there are none.
double period_in_image_px(const StripeObservation& seen) {
  std::vector<double> rows_per_px;
  for (const StripeEdge& edge : seen.edges)
    if (edge.rows_per_px > 0) rows_per_px.push_back(edge.rows_per_px);
  return rows_per_px.empty() ? 0 : seen.period_px / geometry::median(std::move(rows_per_px));
}

}  // namespace

StripeObservation observe_stripes(const Image& image, const geometry::Projection& camera,
                                  const geometry::Projection& projector, const StripePattern& pattern) {
  StripeObservation result;
  const Background background = measure_background(image);
  result.noise_grey = std::max(0.3, background.noise_grey);
  result.inside = silhouette_mask(image, background);
  result.scans_columns = columns_run_across(image, result.inside);
  result.scan_sign = scan_sign(camera, projector, pattern.horizontal, result.scans_columns);

  result.period_px = pattern.period_px;

  const bool columns = result.scans_columns;
  const int lines = int(columns ? image.cols() : image.rows());
  ScanLine line;
  int run = 0;
  for (int index = 0; index < lines; ++index) {
    read_line(image, result.inside, columns, index, line);
    const int length = int(line.grey.size());
    int run_start = 0;
    while (run_start < length) {
      if (!line.inside[run_start]) {
        ++run_start;
        continue;
      }
      int run_end = run_start;
      while (run_end + 1 < length && line.inside[run_end + 1]) ++run_end;
      const auto turns = extrema(line.grey, run_start + kRimPx, run_end - kRimPx, kLeastContrast);
      const size_t before = result.edges.size();
      ++run;
      for (size_t i = 0; i + 1 < turns.size(); ++i) {
        const auto hit = crossing(line.grey, turns[i].at, turns[i + 1].at, 0.5 * (turns[i].grey + turns[i + 1].grey));
        if (!hit) continue;
        StripeEdge edge;
        edge.pixel = columns ? Eigen::Vector2d(index, hit->at) : Eigen::Vector2d(hit->at, index);
        edge.run = run;
        edge.rising = turns[i + 1].high == (result.scan_sign > 0);
        edge.sd_px = std::hypot(kEdgeSd_px, result.noise_grey / std::max(hit->slope, 1.0));
        result.edges.push_back(edge);
      }
      set_scales(result.edges, before, columns, pattern);
      run_start = run_end + 1;
    }
  }
  link_curves(result);
  result.silhouette = where_stripes_cross(image, result.inside, background, period_in_image_px(result),
                                          outline_points(image, result.inside, background));
  return result;
}

std::optional<Eigen::Vector3d> triangulate(const geometry::Projection& camera, const geometry::Projection& projector,
                                           const StripePattern& pattern, const Eigen::Vector2d& pixel,
                                           double projector_px) {
  // Points that the projector sends to row r: (p₁ − r p₂) · [x; 1] = 0.
  const Eigen::Vector4d plane =
      (projector.matrix.row(pattern.horizontal ? 1 : 0) - projector_px * projector.matrix.row(2)).transpose();
  const Eigen::Vector3d eye = geometry::centre(camera), ray = geometry::ray(camera, pixel);
  const double along = plane.head<3>().dot(ray);
  if (std::abs(along) < 1e-3 * plane.head<3>().norm()) return std::nullopt;
  return eye - ray * (plane.dot(eye.homogeneous()) / along);
}

}  // namespace selvedge::observe
