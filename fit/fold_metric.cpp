#include "fit/fold_metric.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "fit/fold_kernels.h"

namespace selvedge::fit {

namespace {

// One filter from its centre tap outwards.
template <class Function>
void append_taps(std::vector<float>& taps, int radius, double spacing, Function function) {
  for (int k = 0; k <= radius; ++k) taps.push_back(float(function(k * spacing)));
}

std::vector<float> filter_taps(int radius, double spacing) {
  const auto e = [](double t) { return std::exp(-t * t); };
  std::vector<float> taps;
  append_taps(taps, radius, spacing, e);
  append_taps(taps, radius, spacing, [&](double t) { return t * e(t); });
  append_taps(taps, radius, spacing, [&](double t) { return (2 * t * t - 1) * e(t); });
  append_taps(taps, radius, spacing, [&](double t) { return (t * t - 0.7515) * e(t); });
  append_taps(taps, radius, spacing, [&](double t) { return (t * t - 2.254) * t * e(t); });

  // G2 has no mean; its samples get none either.
  float* second = taps.data() + kernels::g2 * (radius + 1);
  double mean = second[0];
  for (int k = 1; k <= radius; ++k) mean += 2 * second[k];
  for (int k = 0; k <= radius; ++k) second[k] -= float(mean / (2 * radius + 1));
  return taps;
}

std::vector<float> gaussian_taps(double sd_px) {
  const int radius = sd_px > 0 ? std::max(1, int(std::ceil(3 * sd_px))) : 0;
  std::vector<float> taps(radius + 1);
  double sum = 0;
  for (int k = 0; k <= radius; ++k) {
    taps[k] = float(sd_px > 0 ? std::exp(-0.5 * k * k / (sd_px * sd_px)) : 1.0);
    sum += k == 0 ? taps[k] : 2 * taps[k];
  }
  for (float& tap : taps) tap = float(tap / sum);
  return taps;
}

}  // namespace

FoldMetric::FoldMetric(const FoldMetricOptions& options)
    : options_(options), taps_(filter_taps(options.kernel_radius_px, options.tap_spacing)),
      blur_taps_(gaussian_taps(options.coefficient_blur_px)) {}

AngleMap FoldMetric::angle_map(const render::Image& image) {
  return angle_map(image, std::vector<unsigned char>(size_t(image.size()), 1));
}

AngleMap FoldMetric::angle_map(const render::Image& image, const std::vector<unsigned char>& inside) {
  if (inside.size() != size_t(image.size()))
    throw std::invalid_argument("angle_map: the silhouette has not the image's size");
  AngleMap map;
  map.width = int(image.cols());
  map.height = int(image.rows());
  map.inside = inside;
  map.angle_rad.assign(inside.size(), 0.0f);
  map.gradient_rad_px.assign(inside.size(), 0.0f);

  Box box{map.width, map.height, 0, 0};
  for (int y = 0; y < map.height; ++y) {
    const unsigned char* row = inside.data() + size_t(y) * map.width;
    const unsigned char* first = std::find(row, row + map.width, 1);
    if (first == row + map.width) continue;
    int last = map.width - 1;
    while (row[last] != 1) --last;
    box.left = std::min(box.left, int(first - row));
    box.right = std::max(box.right, last + 1);
    box.top = std::min(box.top, y);
    box.bottom = y + 1;
  }
  if (box.left >= box.right) return map;
  orientation(image, box, map);

  for (int y = std::max(1, box.top); y < std::min(map.height - 1, box.bottom); ++y) {
    const size_t at = size_t(y) * map.width + box.left, above = at - map.width, below = at + map.width;
    kernels::gradient_row(&map.angle_rad[above], &map.angle_rad[at], &map.angle_rad[below], &inside[above], &inside[at],
                          &inside[below], box.right - box.left, &map.gradient_rad_px[at]);
  }
  return map;
}

// Rows stream through two rings: filtered rows (five filters) and rows of smoothed coefficients.
void FoldMetric::orientation(const render::Image& image, Box box, AngleMap& map) {
  const int radius = options_.kernel_radius_px, blur = int(blur_taps_.size()) - 1;
  const int span = 2 * radius + 1, blur_span = 2 * blur + 1;
  const int width = box.right - box.left, wide = width + 2 * blur;
  const size_t stride = size_t(wide), block = stride * kernels::kFilters;
  grey_.resize(wide + 2 * radius);
  filtered_.resize(block * span);
  coefficients_.resize(2 * stride);
  blurred_.resize(size_t(blur_span) * 2 * width);
  std::vector<const float*> filtered_rows(span), c2_rows(blur_span), c3_rows(blur_span);

  const int first = box.top - blur - radius, last = box.bottom - 1 + blur + radius;
  for (int y = first; y <= last; ++y) {
    const unsigned char* pixels = image.data() + size_t(std::clamp(y, 0, map.height - 1)) * map.width;
    for (int x = 0; x < int(grey_.size()); ++x)
      grey_[x] = pixels[std::clamp(x + box.left - blur - radius, 0, map.width - 1)];
    const int step = y - first;
    kernels::filter_row(grey_.data(), wide, taps_.data(), radius, &filtered_[block * (step % span)], stride);
    if (step < 2 * radius) continue;

    for (int j = 0; j < span; ++j) filtered_rows[j] = &filtered_[block * ((step - 2 * radius + j) % span)];
    kernels::coefficients(filtered_rows.data(), stride, wide, taps_.data(), radius, coefficients_.data(),
                          coefficients_.data() + stride);
    const int blur_step = step - 2 * radius;
    float* smoothed = &blurred_[size_t(blur_step % blur_span) * 2 * width];
    kernels::smooth_row(coefficients_.data(), width, blur_taps_.data(), blur, smoothed);
    kernels::smooth_row(coefficients_.data() + stride, width, blur_taps_.data(), blur, smoothed + width);
    if (blur_step < 2 * blur) continue;

    for (int j = 0; j < blur_span; ++j) {
      c2_rows[j] = &blurred_[size_t((blur_step - 2 * blur + j) % blur_span) * 2 * width];
      c3_rows[j] = c2_rows[j] + width;
    }
    const int out = y - radius - blur;
    float* angle = &map.angle_rad[size_t(out) * map.width + box.left];
    kernels::smooth_columns_to_angle(c2_rows.data(), c3_rows.data(), width, blur_taps_.data(), blur, angle);
    const unsigned char* inside = &map.inside[size_t(out) * map.width + box.left];
    for (int x = 0; x < width; ++x)
      if (!inside[x]) angle[x] = 0;
  }
}

FoldError FoldMetric::compare(const AngleMap& recorded, const AngleMap& simulated) const {
  if (recorded.width != simulated.width || recorded.height != simulated.height)
    throw std::invalid_argument("fold metric: the two angle maps differ in size");
  const float pi = std::numbers::pi_v<float>, threshold = float(options_.mask_threshold_rad_px);
  FoldError error;
  for (size_t i = 0; i < recorded.inside.size(); ++i) {
    const bool a = recorded.inside[i], b = simulated.inside[i];
    if (a != b) error.silhouette += 1;
    if (!a || !b) continue;
    ++error.overlap_px;
    if (recorded.gradient_rad_px[i] < threshold) continue;
    ++error.masked_px;
    float d = recorded.angle_rad[i] - simulated.angle_rad[i];
    if (d > 0.5f * pi) d -= pi;
    if (d < -0.5f * pi) d += pi;
    error.fold += double(d) * d;
  }
  error.total = error.fold + options_.silhouette_weight * error.silhouette;
  return error;
}

}  // namespace selvedge::fit
