#include "material_tests/strip_photo.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/QR>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "files/bad_input.h"
#include "geometry/order_statistics.h"

namespace selvedge::material_tests {

using Eigen::Index;
using Eigen::Vector2d;

namespace {

// The grey that the ground has everywhere: a quadratic in x and y, fitted to the picture's upper and side rims and, in
// rounds, without what differs from it most.
cv::Mat ground_of(const cv::Mat& grey) {
  const auto terms = [&](double column, double row) {
    const double x = column / grey.cols - 0.5, y = row / grey.rows - 0.5;
    return (Eigen::Matrix<double, 6, 1>() << 1, x, y, x * x, x * y, y * y).finished();
  };
  std::vector<cv::Point> at;
  const int step = std::max(1, grey.cols / 160);
  for (int y = 0; y < grey.rows; y += step)
    for (int x = 0; x < grey.cols; x += step) at.emplace_back(x, y);
  const auto count = static_cast<Index>(at.size());
  Eigen::MatrixXd a(count, 6);
  Eigen::VectorXd b(count), weight = Eigen::VectorXd::Zero(count);
  const auto in_rim = [&](const cv::Point& p) { return p.y < grey.rows / 8; };
  for (Index i = 0; i < count; ++i) {
    const cv::Point& p = at[static_cast<size_t>(i)];
    a.row(i) = terms(p.x, p.y).transpose();
    b(i) = grey.at<float>(p);
    weight(i) = in_rim(p) ? 1 : 0.3;
  }
  Eigen::Matrix<double, 6, 1> fit = Eigen::Matrix<double, 6, 1>::Zero();
  std::vector<double> above;
  for (Index i = 0; i < count; ++i)
    if (in_rim(at[static_cast<size_t>(i)])) above.push_back(b(i));
  fit(0) = geometry::median(above);
  double scale = 40;  // grey levels; narrows as the fit gets better
  for (int round = 0; round < 12; ++round, scale = std::max(6.0, 0.8 * scale)) {
    const Eigen::VectorXd off = (b - a * fit) / scale;
    const Eigen::VectorXd w = (weight.array() / (1 + off.array().square()).square()).sqrt();
    fit = (w.asDiagonal() * a).colPivHouseholderQr().solve(w.asDiagonal() * b);
  }
  cv::Mat ground(grey.size(), CV_32F);
  for (int y = 0; y < grey.rows; ++y)
    for (int x = 0; x < grey.cols; ++x) ground.at<float>(y, x) = static_cast<float>(terms(x, y).dot(fit));
  return ground;
}

// 0 on the ground, 1 on the strip: a share, so that a pixel that both cover counts as a part of one.
struct Cover {
  cv::Mat share;  // CV_32F; from 0, at least 0.5 in the mask
  cv::Mat mask;   // CV_8U, the largest connected part
};

Cover cover_of(const cv::Mat& grey, const std::string& where) {
  cv::Mat off = cv::abs(grey - ground_of(grey)), small, mask;
  cv::GaussianBlur(off, off, {0, 0}, 0.8);
  off.convertTo(small, CV_8U);
  const double threshold = cv::threshold(small, mask, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU);
  if (threshold < 8) refuse(where, "found nothing that stands out from its ground, expected a strip that does");
  cv::Mat labels, stats, centres;
  const int parts = cv::connectedComponentsWithStats(mask, labels, stats, centres);
  int largest = 0, area = 0;
  for (int part = 1; part < parts; ++part)
    if (stats.at<int>(part, cv::CC_STAT_AREA) > area) area = stats.at<int>(largest = part, cv::CC_STAT_AREA);
  if (area < 50) refuse(where, "found nothing of more than {} pixels, expected a strip", area);
  return {off / (2 * threshold), labels == largest};
}

// Of each column: the first row of the mask, and how far down it goes without a gap. −1 where there is none.
struct Columns {
  std::vector<int> top, length;
};

Columns columns_of(const cv::Mat& mask) {
  Columns out{std::vector<int>(mask.cols, -1), std::vector<int>(mask.cols, 0)};
  for (int x = 0; x < mask.cols; ++x)
    for (int y = 0; y < mask.rows; ++y) {
      if (mask.at<uchar>(y, x) == 0) {
        if (out.top[x] >= 0) break;
        continue;
      }
      if (out.top[x] < 0) out.top[x] = y;
      ++out.length[x];
    }
  return out;
}

// The table stands at the left or right rim; +1: the strip hangs to the right of it.
int side_of(const cv::Mat& mask, const std::optional<Vector2d>& edge, const std::string& where) {
  if (edge) {
    const int x = std::clamp(static_cast<int>(edge->x()), 0, mask.cols - 1);
    int lowest[2] = {0, 0};
    for (int row = 0; row < mask.rows; ++row)
      for (int column = 0; column < mask.cols; ++column)
        if (mask.at<uchar>(row, column) && std::abs(column - x) > 2) lowest[column > x] = row;
    const double left = cv::countNonZero(mask.col(0)), right = cv::countNonZero(mask.col(mask.cols - 1));
    if (left != right) return left > right ? 1 : -1;
    return lowest[1] >= lowest[0] ? 1 : -1;
  }
  const int left = cv::countNonZero(mask.col(1)), right = cv::countNonZero(mask.col(mask.cols - 2));
  if (left == 0 && right == 0)
    refuse(where, "found no table at the left or right rim, expected one, or the edge given (--edge-px X,Y)");
  return left >= right ? 1 : -1;
}

// y as a line in x, at x = 0, and its slope.
std::pair<double, double> line_through(const std::vector<Vector2d>& points) {
  Eigen::MatrixX2d a(static_cast<Index>(points.size()), 2);
  Eigen::VectorXd b(a.rows());
  for (Index i = 0; i < a.rows(); ++i) {
    a.row(i) << 1, points[static_cast<size_t>(i)].x();
    b(i) = points[static_cast<size_t>(i)].y();
  }
  const Vector2d x = a.colPivHouseholderQr().solve(b);
  return {x(0), x(1)};
}

// Where the table ends, subpixel: its front, followed upwards to the strip.
double edge_column(const Cover& cover, const Columns& columns, int side, const std::string& where) {
  const int n = cover.mask.cols, begin = side > 0 ? 1 : n - 2;
  const int deep = columns.length[begin];
  int at = begin;
  while (at > 0 && at < n - 1 && columns.length[at] > 0.4 * deep) at += side;
  std::vector<double> beyond;
  for (int x = at + side * (3 + deep / 25); x > 0 && x < n - 1 && beyond.size() < 8; x += side)
    beyond.push_back(columns.length[x]);
  const double strip = beyond.empty() ? 0 : geometry::median(beyond);
  if (strip < 1 || deep < 3 * strip)
    refuse(where, "found no edge at which the table ends, expected one, or it given (--edge-px X,Y)");
  const int under = columns.top[at - side], window = 6 + deep / 20;
  std::vector<Vector2d> front;  // rows below the strip's middle, and columns
  for (int y = under + static_cast<int>(2.5 * strip); y < under + 8 * deep / 10 && y < cover.mask.rows; ++y)
    for (int x = at - window * side; x > 0 && x < n - 1 && x != at + window * side; x += side) {
      const float a = cover.share.at<float>(y, x), b = cover.share.at<float>(y, x + side);
      if (a < 0.5F || b >= 0.5F) continue;
      front.emplace_back(y - under - strip / 2, x + side * (a - 0.5) / (a - b));
      break;
    }
  return front.size() < 8 ? at : line_through(front).first;
}

// The threshold parted strip and table from the ground; half of the strip's own contrast is where the strip ends.
void set_strip_to_one(Cover& cover, const Columns& columns, double edge, int side) {
  std::vector<double> darkest;
  for (int k = 5; k < 40; ++k) {
    const int x = static_cast<int>(edge + side * k);
    if (x <= 0 || x >= cover.mask.cols || columns.top[static_cast<size_t>(x)] < 0) continue;
    const int top = columns.top[static_cast<size_t>(x)], length = columns.length[static_cast<size_t>(x)];
    double most = 0;
    for (int y = top; y < top + length; ++y) most = std::max(most, double{cover.share.at<float>(y, x)});
    darkest.push_back(most);
  }
  if (!darkest.empty()) cover.share = cv::min(cover.share / std::max(0.5, geometry::median(darkest)), 1.0);
}

float share_at(const cv::Mat& share, const Vector2d& p) {
  const int x = static_cast<int>(std::floor(p.x())), y = static_cast<int>(std::floor(p.y()));
  if (x < 0 || y < 0 || x + 1 >= share.cols || y + 1 >= share.rows) return 0;
  const auto fx = static_cast<float>(p.x() - x), fy = static_cast<float>(p.y() - y);
  return (1 - fy) * ((1 - fx) * share.at<float>(y, x) + fx * share.at<float>(y, x + 1)) +
         fy * ((1 - fx) * share.at<float>(y + 1, x) + fx * share.at<float>(y + 1, x + 1));
}

// Across a strip at p that runs along `direction`: how much of it there is, and where its middle lies.
struct Across {
  double width = 0, middle = 0;  // px; from p, to the direction's right
};

Across across(const cv::Mat& share, const Vector2d& p, const Vector2d& direction, double half) {
  constexpr double kStep = 0.25;
  const Vector2d right(-direction.y(), direction.x());
  // From the middle outwards to the first gap on either side.
  Across out;
  double sum = 0;
  for (const int side : {-1, 1})
    for (double d = side > 0 ? 0 : kStep; d <= half; d += kStep) {
      const double s = share_at(share, p + side * d * right);
      if (s < 0.15 && d > 1) break;
      sum += s * kStep;
      out.middle += side * d * s * kStep;
    }
  out.width = sum;
  if (sum > 0) out.middle /= sum;
  return out;
}

// Pixel positions of the midline from the edge to the tip.
std::vector<Vector2d> follow(const cv::Mat& share, Vector2d at, Vector2d direction, double thickness) {
  std::vector<Vector2d> line;
  const double half = 1.5 * thickness + 2;
  const Vector2d begin = at;
  for (int step = 0; step < 4 * (share.cols + share.rows); ++step) {
    const Across here = across(share, at, direction, half);
    if (here.width < 0.5 * thickness && step > 2) break;
    at += here.middle * Vector2d(-direction.y(), direction.x());
    line.push_back(at);
    const size_t back = std::min<size_t>(line.size() - 1, static_cast<size_t>(std::max(8.0, 2 * thickness)));
    const Vector2d chord = line.back() - line[line.size() - 1 - back];
    if (back > 3 && chord.norm() > 1) {
      // The strip turns on as it did over the last stretch.
      const Vector2d middle = line[line.size() - 1 - back / 2] - line[line.size() - 1 - back], last = chord - middle;
      const double turn = std::atan2(middle.x() * last.y() - middle.y() * last.x(), middle.dot(last));
      const double angle = std::atan2(last.y(), last.x()) + 0.5 * std::clamp(turn, -0.2, 0.2);
      direction = {std::cos(angle), std::sin(angle)};
    }
    at += direction;
  }
  if (line.empty()) line.push_back(begin);
  return line;
}

// A smooth line through points that jitter by a fraction of a pixel: quadratics over 2 h + 1 points.
std::vector<Vector2d> smoothed(const std::vector<Vector2d>& line, int h) {
  std::vector<Vector2d> out(line.size());
  const int n = static_cast<int>(line.size());
  for (int i = 0; i < n; ++i) {
    const int begin = std::max(0, i - h), end = std::min(n, i + h + 1);
    Eigen::MatrixXd a(end - begin, 3), b(end - begin, 2);
    for (int k = begin; k < end; ++k) {
      a.row(k - begin) << 1, k - i, (k - i) * (k - i);
      b.row(k - begin) = line[static_cast<size_t>(k)].transpose();
    }
    out[static_cast<size_t>(i)] = a.colPivHouseholderQr().solve(b).row(0).transpose();
  }
  return out;
}

// Of the strip where it lies on the table: the row of its upper side at the edge and how it slopes towards the tip's
// side, downwards positive, px per px. Nothing where too little of it is seen.
std::optional<std::pair<double, double>> upper_side(const Cover& cover, const Columns& columns, double edge, int side,
                                                    double thickness) {
  std::vector<Vector2d> upper;
  for (int x = static_cast<int>(edge - side * 2 * thickness); x > 1 && x < cover.share.cols - 2; x -= side)
    for (int y = std::max(1, columns.top[static_cast<size_t>(x)] - 3); y < cover.share.rows; ++y) {
      const float above = cover.share.at<float>(y - 1, x), here = cover.share.at<float>(y, x);
      if (here < 0.5F) continue;
      upper.emplace_back(side * (x - edge), y - (here - 0.5) / std::max(1e-3F, here - above));
      break;
    }
  return upper.size() < 40 ? std::nullopt : std::optional(line_through(upper));
}

cv::Mat drawn(const cv::Mat& grey, const std::vector<Vector2d>& line, const Vector2d& edge) {
  cv::Mat bytes, picture;
  grey.convertTo(bytes, CV_8U);
  cv::cvtColor(bytes, picture, cv::COLOR_GRAY2BGR);
  const int thick = std::max(1, grey.cols / 600);
  std::vector<cv::Point> points;
  for (const Vector2d& p : line) points.emplace_back(static_cast<int>(p.x() + 0.5), static_cast<int>(p.y() + 0.5));
  cv::polylines(picture, points, false, {30, 30, 230}, thick, cv::LINE_AA);
  const cv::Point e(static_cast<int>(edge.x() + 0.5), static_cast<int>(edge.y() + 0.5));
  cv::drawMarker(picture, e, {200, 120, 0}, cv::MARKER_CROSS, 16 * thick, 2 * thick, cv::LINE_AA);
  cv::circle(picture, points.back(), 6 * thick, {0, 160, 0}, 2 * thick, cv::LINE_AA);
  return picture;
}

}  // namespace

StripInPhoto find_strip(const std::filesystem::path& photo, const PhotoOptions& options) {
  const std::string where = photo.string();
  cv::Mat bytes = cv::imread(where, cv::IMREAD_GRAYSCALE), grey;
  if (bytes.empty()) refuse(where, "found no picture, expected a JPEG or PNG");
  if (bytes.cols < 64 || bytes.rows < 64)
    refuse(where, "found a picture of {}x{} px, expected 64x64 or more", bytes.cols, bytes.rows);
  bytes.convertTo(grey, CV_32F);
  Cover cover = cover_of(grey, where);
  const int side = side_of(cover.mask, options.edge_px, where);
  const Columns columns = columns_of(cover.mask);
  const double edge = options.edge_px ? options.edge_px->x() : edge_column(cover, columns, side, where);

  set_strip_to_one(cover, columns, edge, side);

  // How thick the strip is shows a little beyond the edge, where it still lies flat.
  std::vector<double> thick;
  for (int k = 6; k < 16; ++k) {
    const int x = static_cast<int>(edge + side * k);
    if (x <= 0 || x >= grey.cols || columns.top[static_cast<size_t>(x)] < 0) continue;
    double sum = 0;
    for (int y = std::max(0, columns.top[static_cast<size_t>(x)] - 3);
         y < std::min(grey.rows, columns.top[static_cast<size_t>(x)] + columns.length[static_cast<size_t>(x)] + 3); ++y)
      sum += cover.share.at<float>(y, x);
    thick.push_back(sum);
  }
  if (thick.empty()) refuse(where, "found no strip beyond the edge at column {:.0f}, expected one", edge);
  StripInPhoto out;
  out.thickness_px = geometry::median(thick);
  const auto upper = upper_side(cover, columns, edge, side, out.thickness_px);
  const double roll = upper ? -std::atan(upper->second) : 0;
  out.roll_deg = roll * 180 / M_PI;
  const auto first = static_cast<size_t>(std::ceil(edge) + side);
  const double row =
      upper ? upper->first + out.thickness_px / 2 : columns.top[first] + 0.5 * (columns.length[first] - 1);
  cv::Mat share = cover.share.clone();  // without the table, whose corner blurs outwards
  for (int x = 0; x < share.cols; ++x)
    if (side * (x - edge) < 4)
      for (int y = static_cast<int>(row + 0.75 * out.thickness_px); y < share.rows; ++y) share.at<float>(y, x) = 0;
  const Vector2d level(side * std::cos(roll), -std::sin(roll)), down(side * std::sin(roll), std::cos(roll));
  const std::vector<Vector2d> line =
      smoothed(follow(share, Vector2d(edge, row), level, out.thickness_px), static_cast<int>(4 + out.thickness_px));
  if (line.size() < 20) refuse(where, "found a strip of {} px beyond the edge, expected 20 or more", line.size());
  out.edge_px = {edge, row};
  out.midline_m.resize(2, static_cast<Index>(line.size()));
  for (size_t i = 0; i < line.size(); ++i) {
    const Vector2d from = line[i] - out.edge_px;
    out.midline_m.col(static_cast<Index>(i)) = 1e-3 * options.mm_per_px * Vector2d(from.dot(level), from.dot(down));
    if (i > 0) out.overhang_m += 1e-3 * options.mm_per_px * (line[i] - line[i - 1]).norm();
  }
  out.picture = drawn(grey, line, out.edge_px);
  return out;
}

}  // namespace selvedge::material_tests
