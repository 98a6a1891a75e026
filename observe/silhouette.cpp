#include "observe/silhouette.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "geometry/order_statistics.h"

namespace selvedge::observe {

namespace {

constexpr int kBorder_px = 8;
constexpr double kNoiseFactor = 5;
constexpr size_t kOutlineStep_px = 2;  // between points of the outline
constexpr double kOutlineSd_px = 0.1;  // what the half-way rule itself is off by

// Bilinear; positions outside are moved to the border.
double grey_at(const Image& image, double x, double y) {
  x = std::clamp(x, 0.0, double(image.cols() - 1) - 1e-6);
  y = std::clamp(y, 0.0, double(image.rows() - 1) - 1e-6);
  const int i = int(x), j = int(y);
  const double u = x - i, v = y - j;
  return (1 - v) * ((1 - u) * image(j, i) + u * image(j, i + 1)) +
         v * ((1 - u) * image(j + 1, i) + u * image(j + 1, i + 1));
}

std::vector<cv::Point> outer_contour(const cv::Mat& mask) {
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  if (contours.empty()) return {};
  return *std::max_element(contours.begin(), contours.end(),
                           [](const auto& a, const auto& b) { return a.size() < b.size(); });
}

// Outward normal at a contour pixel from its neighbours `reach` steps before and behind; nullopt-like zero
// where the outline turns by more than 25 degrees there.
Eigen::Vector2d contour_normal(const std::vector<cv::Point>& contour, size_t at, size_t reach) {
  const size_t n = contour.size();
  const cv::Point a = contour[(at + n - reach) % n], b = contour[at], c = contour[(at + reach) % n];
  const Eigen::Vector2d before(b.x - a.x, b.y - a.y), behind(c.x - b.x, c.y - b.y);
  if (before.norm() == 0 || behind.norm() == 0) return Eigen::Vector2d::Zero();
  if (before.normalized().dot(behind.normalized()) < std::cos(25 * M_PI / 180)) return Eigen::Vector2d::Zero();
  const Eigen::Vector2d along = (before + behind).normalized();
  return {along.y(), -along.x()};
}

bool is_inside(const std::vector<unsigned char>& inside, const Image& image, const Eigen::Vector2d& p) {
  const auto x = std::lround(p.x()), y = std::lround(p.y());
  return x >= 0 && y >= 0 && x < image.cols() && y < image.rows() && inside[size_t(y * image.cols() + x)];
}

// Takes off the contour pixels that are darker than half of what lies further in.
void take_off_spread_light(const Image& image, const Background& background, cv::Mat& mask) {
  const std::vector<cv::Point> contour = outer_contour(mask);
  std::vector<cv::Point> off;
  for (size_t i = 0; i < contour.size(); ++i) {
    Eigen::Vector2d normal = contour_normal(contour, i, 5);
    const Eigen::Vector2d at(contour[i].x, contour[i].y);
    if (normal.isZero()) continue;
    const Eigen::Vector2d in = at - 3 * normal;
    const cv::Point probe(int(std::lround(in.x())), int(std::lround(in.y())));
    if (probe.x < 0 || probe.y < 0 || probe.x >= mask.cols || probe.y >= mask.rows || !mask.at<unsigned char>(probe))
      normal = -normal;
    const double inner = grey_at(image, at.x() - 2.5 * normal.x(), at.y() - 2.5 * normal.y());
    const double deeper = grey_at(image, at.x() - 5 * normal.x(), at.y() - 5 * normal.y());
    // Beside a stripe that runs along the outline, dark fabric and spread light look alike: left as it is.
    if (std::abs(inner - deeper) > 0.25 * (std::max(inner, deeper) - background.grey)) continue;
    if (image(contour[i].y, contour[i].x) < 0.5 * (background.grey + inner)) off.push_back(contour[i]);
  }
  for (const cv::Point& p : off) mask.at<unsigned char>(p) = 0;
}

}  // namespace

Background measure_background(const Image& image) {
  std::vector<double> values;
  for (int y = 0; y < image.rows(); ++y)
    for (int x = 0; x < image.cols(); ++x)
      if (y < kBorder_px || x < kBorder_px || y >= image.rows() - kBorder_px || x >= image.cols() - kBorder_px)
        values.push_back(image(y, x));
  Background background;
  background.grey = geometry::median(values);
  // Whole grey levels hide small noise from a median of deviations; the mean of those within reach does not.
  double sum = 0, square = 0;
  size_t count = 0;
  for (const double v : values)
    if (std::abs(v - background.grey) <= 6) {
      sum += v;
      square += v * v;
      ++count;
    }
  background.grey = sum / double(count);
  background.noise_grey = std::sqrt(std::max(0.0, square / double(count) - background.grey * background.grey));
  return background;
}

std::vector<unsigned char> silhouette_mask(const Image& image, const Background& background) {
  const cv::Mat view(int(image.rows()), int(image.cols()), CV_8U, const_cast<unsigned char*>(image.data()));
  const double threshold = background.grey + kNoiseFactor * std::max(0.6, background.noise_grey);
  cv::Mat mask = view > threshold;
  // A close bridges specks that noise leaves in dark stripes; then the largest outline, filled.
  cv::morphologyEx(mask, mask, cv::MORPH_CLOSE, cv::Mat::ones(3, 3, CV_8U));
  const std::vector<cv::Point> contour = outer_contour(mask);
  mask.setTo(0);
  if (!contour.empty()) cv::drawContours(mask, std::vector<std::vector<cv::Point>>{contour}, 0, 255, cv::FILLED);
  take_off_spread_light(image, background, mask);
  take_off_spread_light(image, background, mask);

  std::vector<unsigned char> inside(size_t(image.size()));
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) inside[size_t(y) * mask.cols + x] = mask.at<unsigned char>(y, x) ? 1 : 0;
  return inside;
}

std::vector<SilhouettePoint> outline_points(const Image& image, const std::vector<unsigned char>& inside,
                                            const Background& background) {
  cv::Mat mask(int(image.rows()), int(image.cols()), CV_8U, const_cast<unsigned char*>(inside.data()));
  const std::vector<cv::Point> contour = outer_contour(mask);
  const double noise = std::max(0.5, background.noise_grey);
  std::vector<SilhouettePoint> points;
  for (size_t i = 0; i < contour.size(); i += kOutlineStep_px) {
    const Eigen::Vector2d at(contour[i].x, contour[i].y);
    Eigen::Vector2d normal = contour_normal(contour, i, 8);
    if (normal.isZero()) continue;
    if (!is_inside(inside, image, at - 3 * normal)) normal = -normal;
    if (!is_inside(inside, image, at - 4 * normal) || is_inside(inside, image, at + 3 * normal)) continue;
    if (at.x() < 5 || at.y() < 5 || at.x() > image.cols() - 6 || at.y() > image.rows() - 6) continue;

    const auto profile = [&](double s) { return grey_at(image, at.x() + s * normal.x(), at.y() + s * normal.y()); };
    const double outer = profile(-2), middle = profile(-3), deep = profile(-4.5);
    const double level = 0.5 * (outer + middle), contrast = level - background.grey;
    if (contrast < 4 * noise || profile(3) > background.grey + 3 * noise) continue;
    if (std::max(std::abs(outer - middle), std::abs(outer - deep)) > 0.15 * contrast + 2 * noise) continue;
    const double half = background.grey + 0.5 * contrast;
    double crossing = 10;
    constexpr double step = 0.25;
    for (double s = 3; s > -2; s -= step) {
      const double here = profile(s), next = profile(s - step);
      if (here < half && next >= half) {
        crossing = s - step * (half - here) / (next - here);
        break;
      }
    }
    if (crossing > 5) continue;
    const double slope = std::abs(profile(crossing - 0.5) - profile(crossing + 0.5));
    SilhouettePoint point;
    point.pixel = at + crossing * normal;
    point.normal = normal;
    point.sd_px = std::hypot(kOutlineSd_px, noise / std::max(slope, 1.0));
    points.push_back(point);
  }
  return points;
}

std::vector<SilhouettePoint> where_stripes_cross(const Image& image, const std::vector<unsigned char>& inside,
                                                 const Background& background, double period_px,
                                                 const std::vector<SilhouettePoint>& points) {
  constexpr double kBeyondEdge_px = 3;
  constexpr int kAside_px = 3;
  const double of_noise = 0.5 * std::pow(std::max(0.5, background.noise_grey), 2);  // square of a slope over two pixels
  const auto grey = [&](const Eigen::Vector2d& at) { return grey_at(image, at.x(), at.y()); };
  std::vector<SilhouettePoint> out;
  for (const SilhouettePoint& point : points) {
    const Eigen::Vector2d n = point.normal, t(-n.y(), n.x());
    double along_n = 0, along_t = 0, count = 0;
    for (double deep = kBeyondEdge_px; deep < kBeyondEdge_px + period_px; ++deep)
      for (int aside = -kAside_px; aside <= kAside_px; ++aside) {
        const Eigen::Vector2d p = point.pixel - deep * n + aside * t;
        if (!is_inside(inside, image, p - n) || !is_inside(inside, image, p + n)) continue;
        along_n += std::pow(0.5 * (grey(p + n) - grey(p - n)), 2);
        along_t += std::pow(0.5 * (grey(p + t) - grey(p - t)), 2);
        ++count;
      }
    const bool has_stripes = along_n + along_t > 8 * of_noise * count;
    if (!has_stripes || along_t > along_n) out.push_back(point);
  }
  return out;
}

}  // namespace selvedge::observe
