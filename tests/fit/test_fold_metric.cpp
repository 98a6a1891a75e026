#include "fit/fold_metric.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace selvedge::fit {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// Stripes of which the direction across is `angle_deg` counter-clockwise from the right, as seen.
render::Image stripes(double angle_deg, double period_px, double noise, unsigned seed, bool square = true) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  render::Image image(200, 200);
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x) {
      const double across = x * std::cos(angle_deg * kDegree) - y * std::sin(angle_deg * kDegree);
      const double wave = std::sin(2 * std::numbers::pi * across / period_px);
      const double shape = square ? std::tanh(2.5 * wave) : wave;
      image(y, x) = static_cast<unsigned char>(std::clamp(110 + 95 * shape + noise * normal(random), 0.0, 255.0));
    }
  return image;
}

double wrapped(double d) { return d - std::numbers::pi * std::round(d / std::numbers::pi); }

TEST(FoldMetric, RecoversAKnownOrientationWithinHalfADegree) {
  FoldMetric metric;
  for (const double period : {10.0, 14.0, 18.0})
    for (double angle = -87; angle <= 90; angle += 7.3) {
      const AngleMap map = metric.angle_map(stripes(angle, period, 1.0, 3));
      double worst = 0;
      for (int y = 20; y < 180; ++y)
        for (int x = 20; x < 180; ++x)
          worst = std::max(worst, std::abs(wrapped(map.angle_rad[y * 200 + x] - angle * kDegree)));
      EXPECT_LT(worst / kDegree, 0.5) << "angle " << angle << " period " << period;
    }
}

// The definition written out: the seven basis filters as 13 × 13 kernels through cv::filter2D.
TEST(FoldMetric, FastPathEqualsThePlainFilterBank) {
  render::Image image = stripes(63, 13, 8, 7);
  image.block(60, 90, 50, 40) = stripes(10, 9, 8, 8).block(0, 0, 50, 40);
  const FoldMetricOptions options;
  FoldMetric metric(options);
  const AngleMap map = metric.angle_map(image);

  const cv::Mat view(200, 200, CV_8U, image.data());
  cv::Mat grey;
  view.convertTo(grey, CV_64F);
  const auto response = [&](auto function) {
    const int r = options.kernel_radius_px;
    cv::Mat kernel(2 * r + 1, 2 * r + 1, CV_64F);
    for (int j = -r; j <= r; ++j)
      for (int i = -r; i <= r; ++i) {
        const double x = i * options.tap_spacing, y = j * options.tap_spacing;
        kernel.at<double>(j + r, i + r) = function(x, y) * std::exp(-x * x - y * y);
      }
    cv::Mat out;
    cv::filter2D(grey, out, CV_64F, kernel, {-1, -1}, 0, cv::BORDER_REPLICATE);
    return out;
  };
  const cv::Mat a = response([](double x, double) { return 0.9213 * (2 * x * x - 1); });
  const cv::Mat b = response([](double x, double y) { return 1.843 * x * y; });
  const cv::Mat c = response([](double, double y) { return 0.9213 * (2 * y * y - 1); });
  const cv::Mat ha = response([](double x, double) { return 0.978 * (x * x * x - 2.254 * x); });
  const cv::Mat hb = response([](double x, double y) { return 0.978 * (x * x - 0.7515) * y; });
  const cv::Mat hc = response([](double x, double y) { return 0.978 * (y * y - 0.7515) * x; });
  const cv::Mat hd = response([](double, double y) { return 0.978 * (y * y * y - 2.254 * y); });
  const auto m = [](const cv::Mat& p, const cv::Mat& q) { return cv::Mat(p.mul(q)); };
  cv::Mat c2 = 0.5 * (m(a, a) - m(c, c)) + 0.46875 * (m(ha, ha) - m(hd, hd)) + 0.28125 * (m(hb, hb) - m(hc, hc)) +
               0.1875 * (m(ha, hc) - m(hb, hd));
  cv::Mat c3 = -m(a, b) - m(b, c) - 0.9375 * (m(hc, hd) + m(ha, hb)) - 1.6875 * m(hb, hc) - 0.1875 * m(ha, hd);
  const int blur = int(std::ceil(3 * options.coefficient_blur_px));
  for (cv::Mat* coefficient : {&c2, &c3})
    cv::GaussianBlur(*coefficient, *coefficient, {2 * blur + 1, 2 * blur + 1}, options.coefficient_blur_px);
  for (int y = 15; y < 185; ++y)
    for (int x = 15; x < 185; ++x) {
      const double c2_here = c2.at<double>(y, x), c3_here = c3.at<double>(y, x);
      if (std::hypot(c2_here, c3_here) < 1e4) continue;  // no direction there
      ASSERT_NEAR(wrapped(map.angle_rad[y * 200 + x] - 0.5 * std::atan2(c3_here, c2_here)), 0, 2e-3) << x << " " << y;
    }
}

TEST(FoldMetric, SilhouetteBoxDoesNotChangeTheAngles) {
  const render::Image image = stripes(30, 14, 1, 5);
  std::vector<unsigned char> inside(200 * 200, 0);
  for (int y = 55; y < 140; ++y)
    for (int x = 40; x < 150; ++x) inside[y * 200 + x] = 1;
  FoldMetric metric;
  const AngleMap whole = metric.angle_map(image), part = metric.angle_map(image, inside);
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x)
      ASSERT_EQ(part.angle_rad[y * 200 + x], inside[y * 200 + x] ? whole.angle_rad[y * 200 + x] : 0);
}

TEST(FoldMetric, ErrorIsTheMaskedWrappedDifferencePlusATenthOfTheSilhouettes) {
  AngleMap recorded;
  recorded.width = 3;
  recorded.height = 1;
  recorded.inside = {1, 1, 1};
  recorded.angle_rad = {1.5f, 0.2f, 0.0f};
  recorded.gradient_rad_px = {0.5f, 0.001f, 0.5f};
  AngleMap simulated = recorded;
  simulated.angle_rad = {-1.5f, 0.9f, 0.0f};
  simulated.inside = {1, 1, 0};
  const FoldError error = FoldMetric().compare(recorded, simulated);
  EXPECT_NEAR(error.fold, std::pow(std::numbers::pi - 3.0, 2), 1e-6);
  EXPECT_EQ(error.silhouette, 1);
  EXPECT_NEAR(error.total, error.fold + 0.1, 1e-12);
  EXPECT_EQ(error.overlap_px, 2);
  EXPECT_EQ(error.masked_px, 1);
}

TEST(FoldMetric, GradientShowsWhereStripesTurn) {
  render::Image image(200, 200);
  image.leftCols(100) = stripes(80, 14, 0, 1).leftCols(100);
  image.rightCols(100) = stripes(100, 14, 0, 1).rightCols(100);
  FoldMetric metric;
  const AngleMap map = metric.angle_map(image);
  EXPECT_LT(map.gradient_rad_px[100 * 200 + 40], 0.002);
  EXPECT_GT(map.gradient_rad_px[100 * 200 + 100], 0.02);
}

}  // namespace
}  // namespace selvedge::fit
