// `./selvedge bench metric`: the angle map of a 640×480 frame beside the same filter bank in plain cv::filter2D, and
// the two ways to picture a simulated fabric, all in one run on one core.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <stdexcept>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "cli/verify/figures.h"
#include "fit/fold_metric.h"
#include "geometry/projection.h"
#include "geometry/triangle_mesh.h"
#include "render/row_map.h"
#include "render/stripe_renderer.h"

namespace selvedge::cli {

namespace {

double median_ms(int repeats, const std::function<void()>& work) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  return median(std::move(times));
}

// The seven basis filters as whole kernels, C2 and C3, blurred, angle: the metric's definition in OpenCV's words.
cv::Mat angle_by_filter2d(const cv::Mat& grey, const fit::FoldMetricOptions& options) {
  const auto response = [&](const std::function<double(double, double)>& polynomial) {
    const int r = options.kernel_radius_px;
    cv::Mat kernel(2 * r + 1, 2 * r + 1, CV_32F), out;
    for (int j = -r; j <= r; ++j)
      for (int i = -r; i <= r; ++i) {
        const double x = i * options.tap_spacing, y = j * options.tap_spacing;
        kernel.at<float>(j + r, i + r) = float(polynomial(x, y) * std::exp(-x * x - y * y));
      }
    cv::filter2D(grey, out, CV_32F, kernel, {-1, -1}, 0, cv::BORDER_REPLICATE);
    return out;
  };
  const cv::Mat a = response([](double x, double) { return 0.9213 * (2 * x * x - 1); });
  const cv::Mat b = response([](double x, double y) { return 1.843 * x * y; });
  const cv::Mat c = response([](double, double y) { return 0.9213 * (2 * y * y - 1); });
  const cv::Mat ha = response([](double x, double) { return 0.978 * (x * x * x - 2.254 * x); });
  const cv::Mat hb = response([](double x, double y) { return 0.978 * (x * x - 0.7515) * y; });
  const cv::Mat hc = response([](double x, double y) { return 0.978 * (y * y - 0.7515) * x; });
  const cv::Mat hd = response([](double, double y) { return 0.978 * (y * y * y - 2.254 * y); });
  cv::Mat c2 = 0.5 * (a.mul(a) - c.mul(c)) + 0.46875 * (ha.mul(ha) - hd.mul(hd)) + 0.28125 * (hb.mul(hb) - hc.mul(hc)) +
               0.1875 * (ha.mul(hc) - hb.mul(hd));
  cv::Mat c3 = -a.mul(b) - b.mul(c) - 0.9375 * (hc.mul(hd) + ha.mul(hb)) - 1.6875 * hb.mul(hc) - 0.1875 * ha.mul(hd);
  const int blur = int(std::ceil(3 * options.coefficient_blur_px));
  cv::GaussianBlur(c2, c2, {2 * blur + 1, 2 * blur + 1}, options.coefficient_blur_px, 0, cv::BORDER_REPLICATE);
  cv::GaussianBlur(c3, c3, {2 * blur + 1, 2 * blur + 1}, options.coefficient_blur_px, 0, cv::BORDER_REPLICATE);
  cv::Mat angle;
  cv::phase(c2, c3, angle);
  return 0.5 * angle;
}

}  // namespace

std::vector<Figure> bench_metric(const FigureOptions& options) {
  cv::setNumThreads(1);
  const geometry::Projection camera = geometry::looking_at({0.05, -1.0, -0.1}, {0, 0, -0.15}, 1000, 640, 480);
  const geometry::Projection projector = geometry::looking_at({-0.1, -0.95, 0.4}, {0, 0, -0.15}, 1450, 1024, 768);
  const geometry::TriangleMesh mesh = geometry::make_grid_mesh(0.3, 0.3, 33, 33);
  Eigen::Matrix3Xd position(3, mesh.rest_uv.size());
  for (size_t i = 0; i < mesh.rest_uv.size(); ++i) {
    const double u = mesh.rest_uv[i].x() - 0.15, v = mesh.rest_uv[i].y();
    position.col(Eigen::Index(i)) = Eigen::Vector3d(u, 0.02 * std::sin(30 * u) + 0.01 * std::sin(25 * v), -v);
  }

  render::StripeRenderer renderer(camera, projector);
  renderer.set_pattern({});
  const render::Image image = renderer.render(position, mesh.triangles);
  render::RowMap map(camera, projector);
  map.rasterise(position, mesh.triangles);
  std::vector<unsigned char> inside;
  map.fill_silhouette(inside);

  fit::FoldMetric metric;
  const int repeats = options.quick ? 5 : 41;
  const fit::AngleMap recorded = metric.angle_map(image, inside);
  double kept = 0;
  const double fabric =
      median_ms(repeats, [&] { kept += metric.compare(recorded, metric.angle_map(image, inside)).total; });
  const double whole = median_ms(repeats, [&] { kept += metric.angle_map(image).angle_rad[0]; });
  cv::Mat grey;
  cv::Mat(480, 640, CV_8U, const_cast<unsigned char*>(image.data())).convertTo(grey, CV_32F);
  const double plain =
      median_ms(options.quick ? 3 : 15, [&] { kept += angle_by_filter2d(grey, metric.options()).at<float>(0, 0); });
  std::vector<float> row, column, depth;
  const double scanline = median_ms(repeats, [&] {
    map.rasterise(position, mesh.triangles);
    map.fill(row, column, depth);
  });
  const double osmesa =
      median_ms(options.quick ? 3 : 21, [&] { kept += renderer.render(position, mesh.triangles)(240, 320); });
  if (!std::isfinite(kept)) throw std::runtime_error("bench metric: the work gave no number");

  const std::string frame = "640x480 frame: ";
  return {
      {frame + "angle map and error over the fabric", fabric, 10, "ms", Relation::shown, "aim on an idle core"},
      {frame + "angle map of every pixel", whole, 10, "ms", Relation::shown, "aim on an idle core"},
      {frame + "the same bank in plain cv::filter2D", plain, 10, "ms", Relation::shown, ""},
      {"cv::filter2D over ours, every pixel", plain / whole, 1, "x", Relation::shown, "the same run"},
      {frame + "projector rows of 2048 triangles by scanlines", scanline, 3, "ms", Relation::shown,
       "aim on an idle core"},
      {frame + "picture of 2048 triangles through OSMesa", osmesa, 20, "ms", Relation::shown,
       "docs: 13 (20 loaded) ms without shadows"},
  };
}

}  // namespace selvedge::cli
