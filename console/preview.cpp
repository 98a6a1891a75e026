#include "console/preview.h"

#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "capture/trial/grey_png.h"
#include "geometry/order_statistics.h"
#include "observe/silhouette.h"

namespace selvedge::console {

namespace {

std::vector<StripeTile> tiles_of(const cv::Mat& frame, const cv::Mat& inside) {
  std::vector<StripeTile> tiles;
  constexpr int count = kTile_px * kTile_px;
  for (int y = 0; y + kTile_px <= frame.rows; y += kTile_px)
    for (int x = 0; x + kTile_px <= frame.cols; x += kTile_px) {
      const cv::Rect box(x, y, kTile_px, kTile_px);
      if (cv::countNonZero(inside(box)) < count) continue;
      std::array<int, 256> histogram{};
      for (int row = y; row < y + kTile_px; ++row)
        for (int column = x; column < x + kTile_px; ++column) ++histogram[frame.at<uint8_t>(row, column)];
      int white = 0;
      for (size_t grey = 250; grey < 256; ++grey) white += histogram[grey];
      tiles.push_back(
          {x, y, geometry::level_of_share(histogram, 0.9, count) - geometry::level_of_share(histogram, 0.1, count),
           static_cast<double>(white) / count});
    }
  return tiles;
}

}  // namespace

LivePicture live_picture(const std::vector<uint8_t>& pixels, int width_px, int height_px, bool stripes) {
  LivePicture picture;
  picture.width_px = width_px;
  picture.height_px = height_px;
  const cv::Mat frame(height_px, width_px, CV_8UC1, const_cast<uint8_t*>(pixels.data()));
  cv::Mat half;
  cv::resize(frame, half, {width_px / 2, height_px / 2}, 0, 0, cv::INTER_AREA);
  picture.png = trial::encode_grey_png(half.data, half.cols, half.rows, 1);

  const Eigen::Map<const render::Image> image(pixels.data(), height_px, width_px);
  const observe::Background background = observe::measure_background(image);
  std::vector<unsigned char> mask = observe::silhouette_mask(image, background);
  if (mask.size() != pixels.size()) return picture;
  const cv::Mat inside(height_px, width_px, CV_8UC1, mask.data());
  picture.inside_share = static_cast<double>(cv::countNonZero(inside)) / static_cast<double>(mask.size());
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(inside, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  for (const auto& contour : contours) {
    if (contour.size() < 40) continue;
    std::vector<cv::Point> simple;
    cv::approxPolyDP(contour, simple, 1.0, true);
    std::vector<int> curve;
    for (const cv::Point& p : simple) curve.insert(curve.end(), {p.x, p.y});
    picture.outline.push_back(std::move(curve));
  }
  if (stripes) picture.tiles = tiles_of(frame, inside);
  return picture;
}

std::string overlay_json(const LivePicture& picture) {
  nlohmann::json tiles = nlohmann::json::array();
  for (const StripeTile& t : picture.tiles)
    tiles.push_back({t.x, t.y, t.contrast, static_cast<int>(100 * t.saturated)});
  return nlohmann::json{{"width", picture.width_px},
                        {"height", picture.height_px},
                        {"outline", picture.outline},
                        {"tile", kTile_px},
                        {"tiles", tiles},
                        {"inside", picture.inside_share}}
      .dump();
}

}  // namespace selvedge::console
