#include "calib/blobs.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <opencv2/imgproc.hpp>

#include "geometry/order_statistics.h"

namespace selvedge::calib {

namespace {

struct Window {
  int left, top, right, bottom;  // right and bottom one beyond
};

// Median grey of the window's border: the background that the blob stands on.
double border_median(const GreyImage& image, const Window& w) {
  std::vector<unsigned char> border;
  for (int row = w.top; row < w.bottom; ++row)
    for (int column = w.left; column < w.right; ++column)
      if (row == w.top || row == w.bottom - 1 || column == w.left || column == w.right - 1)
        border.push_back(image(row, column));
  return geometry::median(std::move(border));
}

Blob measure(const GreyImage& image, const cv::Mat& labels, int label, const Window& tight) {
  const int rim = 2;
  const Window w{std::max(tight.left - rim, 0), std::max(tight.top - rim, 0),
                 std::min<int>(tight.right + rim, static_cast<int>(image.cols())),
                 std::min<int>(tight.bottom + rim, static_cast<int>(image.rows()))};
  Blob blob;
  blob.cut_off = tight.left == 0 || tight.top == 0 || tight.right == image.cols() || tight.bottom == image.rows();
  const double background = border_median(image, w);
  double weight = 0, inside = 0, saturated = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero(), mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (int row = w.top; row < w.bottom; ++row)
    for (int column = w.left; column < w.right; ++column) {
      const int here = labels.at<int>(row, column);
      if (here != 0 && here != label) continue;
      const Eigen::Vector2d place(column, row);
      // The rim counts only next to the blob, so that a neighbour's glow stays out.
      bool near = here == label;
      for (int i = std::max(row - rim, 0); !near && i <= std::min<int>(row + rim, labels.rows - 1); ++i)
        for (int j = std::max(column - rim, 0); !near && j <= std::min<int>(column + rim, labels.cols - 1); ++j)
          near = labels.at<int>(i, j) == label;
      if (!near) continue;
      const double over = std::max(image(row, column) - background, 0.0);
      weight += over;
      sum += over * place;
      if (here != label) continue;
      ++inside;
      saturated += image(row, column) >= 254;
      mean += place;
      moments += place * place.transpose();
    }
  blob.area_px = inside;
  blob.saturated_share = saturated / inside;
  mean /= inside;
  blob.centre = weight > 0 ? Eigen::Vector2d(sum / weight) : mean;
  // A pixel is itself 1/12 wide in second moment.
  const Eigen::Matrix2d spread = moments / inside - mean * mean.transpose() + Eigen::Matrix2d::Identity() / 12;
  const Eigen::Vector2d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvalues().cwiseMax(1e-9);
  blob.elongation = std::sqrt(axes[1] / axes[0]);
  blob.fill = inside / (4 * M_PI * std::sqrt(axes[0] * axes[1]));
  return blob;
}

}  // namespace

std::vector<Blob> find_blobs(const GreyImage& image, const BlobOptions& options) {
  std::array<long, 256> histogram{};
  for (Eigen::Index i = 0; i < image.size(); ++i) ++histogram[image.data()[i]];
  const int dark = geometry::level_of_share(histogram, 0.5, static_cast<double>(image.size()));
  // The markers cover little of the image: the bright end is that of its brightest few hundred pixels.
  const double few = std::min(0.01, 300.0 / static_cast<double>(image.size()));
  const int bright = geometry::level_of_share(histogram, 1 - few, static_cast<double>(image.size()));
  if (bright - dark < options.least_contrast) return {};
  const double threshold = dark + options.threshold_share * (bright - dark);

  const cv::Mat grey(static_cast<int>(image.rows()), static_cast<int>(image.cols()), CV_8U,
                     const_cast<unsigned char*>(image.data()));
  cv::Mat mask, labels, statistics, centroids;
  cv::threshold(grey, mask, threshold, 255, cv::THRESH_BINARY);
  const int count = cv::connectedComponentsWithStats(mask, labels, statistics, centroids, 8, CV_32S);
  std::vector<Blob> blobs;
  for (int label = 1; label < count; ++label) {
    const int area = statistics.at<int>(label, cv::CC_STAT_AREA);
    if (area < options.least_area_px || area > options.most_area_px) continue;
    const int left = statistics.at<int>(label, cv::CC_STAT_LEFT), top = statistics.at<int>(label, cv::CC_STAT_TOP);
    blobs.push_back(measure(image, labels, label,
                            {left, top, left + statistics.at<int>(label, cv::CC_STAT_WIDTH),
                             top + statistics.at<int>(label, cv::CC_STAT_HEIGHT)}));
  }
  return blobs;
}

bool looks_like_one_disc(const Blob& blob) { return !blob.cut_off && blob.elongation < 2.2 && blob.fill > 0.85; }

}  // namespace selvedge::calib
