#include "station/exchange/outline_import.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "files/bad_input.h"
#include "geometry/polyline.h"
#include "material_tests/silhouette.h"
#include "station/exchange/named_columns.h"

namespace selvedge::station {

namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::Matrix2Xd;
using material_tests::PictureScale;

namespace {

// Largest circles of outlines that all show the support differ by less than this share.
constexpr double kSupportShows = 0.03;
constexpr Index kMostPoints = 720;

struct Capture {
  fs::path file;
  int number = 0;
  cv::Mat grey;
  Matrix2Xd outline_px;  // about the centre, y up
};
using Samples = std::map<std::string, std::vector<Capture>>;

// "sample-2-capture-3": sample-2, 3.
std::pair<std::string, int> sample_and_capture(const std::string& stem) {
  const size_t digit = stem.find_last_not_of("0123456789");
  const size_t from = digit == std::string::npos ? 0 : digit + 1;
  if (from == stem.size()) return {stem, 1};
  std::string sample = stem.substr(0, from);
  for (const std::string& ending : {std::string("capture"), std::string("observation"), std::string("obs")}) {
    while (!sample.empty() && (sample.back() == '-' || sample.back() == '_')) sample.pop_back();
    if (sample.size() >= ending.size() && sample.compare(sample.size() - ending.size(), ending.size(), ending) == 0)
      sample.resize(sample.size() - ending.size());
  }
  while (!sample.empty() && (sample.back() == '-' || sample.back() == '_')) sample.pop_back();
  return {sample.empty() ? "sample" : sample, std::atoi(stem.substr(from).c_str())};
}

bool is_picture(const fs::path& file) {
  std::string ending = file.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending == ".jpg" || ending == ".jpeg" || ending == ".png";
}

cv::Mat grey_of_file(const fs::path& file) {
  try {
    return cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) { return {}; }
}

PictureScale scale_of(const OutlineImport& from, const cv::Mat& grey, double px_per_m) {
  const Eigen::Vector2d centre = from.centre_px.value_or(Eigen::Vector2d((grey.cols - 1) / 2.0, (grey.rows - 1) / 2.0));
  return {centre.x(), centre.y(), px_per_m};
}

Capture read_capture(const OutlineImport& from, const fs::path& file, int number) {
  Capture c{file, number, grey_of_file(file), {}};
  if (c.grey.empty()) refuse(file.string(), "is no picture that can be read");
  cv::Mat dark = c.grey.clone();
  if (cv::mean(dark.row(0))[0] < cv::mean(dark(cv::Rect(dark.cols / 2 - 2, dark.rows / 2 - 2, 4, 4)))[0])
    dark = 255 - dark;
  const trial::GreyImage image = Eigen::Map<const trial::GreyImage>(dark.data, dark.rows, dark.cols);
  try {
    c.outline_px = material_tests::outline_of(image, scale_of(from, c.grey, 1));
  } catch (const std::runtime_error& e) {
    refuse(file.string(), "{}, expected one disc on a plain background", e.what());
  }
  return c;
}

Samples read_samples(const OutlineImport& from) {
  std::vector<fs::path> files;
  if (fs::is_directory(from.source)) {
    for (const auto& entry : fs::directory_iterator(from.source))
      if (entry.is_regular_file() && is_picture(entry.path())) files.push_back(entry.path());
    if (files.empty()) refuse(from.source.string(), "found no picture (.jpg, .png) in it, expected some");
  } else {
    files.push_back(from.source);
  }
  std::sort(files.begin(), files.end());
  Samples samples;
  for (const fs::path& file : files) {
    const auto [sample, number] = sample_and_capture(file.stem().string());
    samples[sample].push_back(read_capture(from, file, number));
  }
  for (auto& [name, captures] : samples)
    std::sort(captures.begin(), captures.end(), [](const Capture& a, const Capture& b) { return a.number < b.number; });
  return samples;
}

// From the support's rim, where it shows.
double px_per_m(const OutlineImport& from, const Samples& samples, std::string& sentence) {
  if (from.mm_per_px > 0) {
    sentence = fmt::format("scale {:.4f} mm/px as given", from.mm_per_px);
    return 1e3 / from.mm_per_px;
  }
  std::vector<double> radius_px;
  for (const auto& [name, captures] : samples)
    for (const Capture& c : captures) radius_px.push_back(material_tests::largest_inside(c.outline_px).radius_m);
  const auto [least, most] = std::minmax_element(radius_px.begin(), radius_px.end());
  if (radius_px.size() < 3 || *most > *least * (1 + kSupportShows))
    refuse(
        "--mm-per-px",
        "found nothing, and the largest circles inside {} outlines have radii of {:.2f} to {:.2f} px: expected three "
        "at least within {:.0f} % of each other, the support's rim, or the scale",
        radius_px.size(), *least, *most, 100 * kSupportShows);
  const double scale = *least / (from.support_m / 2);
  sentence = fmt::format(
      "scale {:.4f} mm/px from the support's rim: the largest circles inside {} outlines have radii "
      "of {:.2f} to {:.2f} px, the least is taken for {:.0f} mm",
      1e3 / scale, radius_px.size(), *least, *most, 500 * from.support_m);
  return scale;
}

std::string picture_of(const OutlineImport& from, const Capture& c, double scale) {
  constexpr int kTimes = 3;
  cv::Mat grey, view;
  cv::resize(c.grey, grey, {}, kTimes, kTimes, cv::INTER_LINEAR);
  cv::cvtColor(grey, view, cv::COLOR_GRAY2BGR);
  const PictureScale at = scale_of(from, c.grey, 1);
  const auto pixel = [&](double x, double y) {
    return cv::Point(static_cast<int>(std::lround(kTimes * (at.centre_column_px + x + 0.5))),
                     static_cast<int>(std::lround(kTimes * (at.centre_row_px - y + 0.5))));
  };
  std::vector<cv::Point> line;
  for (Index i = 0; i < c.outline_px.cols(); ++i) line.push_back(pixel(c.outline_px(0, i), c.outline_px(1, i)));
  cv::polylines(view, line, true, {0, 0, 220}, 2, cv::LINE_AA);
  cv::circle(view, pixel(0, 0), static_cast<int>(std::lround(kTimes * scale * from.support_m / 2)), {220, 120, 0}, 2,
             cv::LINE_AA);
  std::vector<unsigned char> png;
  cv::imencode(".png", view, png);
  return {png.begin(), png.end()};
}

Matrix2Xd at_most_720(const Matrix2Xd& outline) {
  if (outline.cols() <= kMostPoints) return outline;
  Matrix2Xd out(2, kMostPoints);
  for (Index i = 0; i < kMostPoints; ++i) out.col(i) = outline.col(outline.cols() * i / kMostPoints);
  return out;
}

trial::Trial disc_of(const OutlineImport& from, const std::string& name) {
  if (!from.areal_mass) refuse("--areal-mass", "found nothing, expected kg/m²: a disc hangs by its weight");
  trial::Trial t;
  t.name = name;
  t.experiment = trial::Experiment::cusick;
  t.fabric = {from.fabric, from.disc_m, from.disc_m, *from.areal_mass * M_PI / 4 * from.disc_m * from.disc_m, true};
  t.cusick = trial::Cusick{from.disc_m, from.support_m, {}};
  return t;
}

ImportedOutlines of_csv(const OutlineImport& from) {
  ImportedOutlines out{{disc_of(from, from.source.stem().string())}, "scale as in the file", 0, {}};
  const NamedColumns columns(from.source, from.columns);
  const std::vector<int> capture = columns.whole_numbers("capture");
  const std::vector<double> x_m = columns.first_of({{"x_m", 1}, {"x_mm", 1e-3}}),
                            y_m = columns.first_of({{"y_m", 1}, {"y_mm", 1e-3}});
  std::map<int, std::vector<Eigen::Vector2d>> captures;
  for (size_t row = 0; row < capture.size(); ++row) captures[capture[row]].emplace_back(x_m[row], y_m[row]);
  for (const auto& [number, points] : captures) {
    Matrix2Xd outline(2, static_cast<Index>(points.size()));
    for (size_t i = 0; i < points.size(); ++i) outline.col(static_cast<Index>(i)) = points[i];
    if (geometry::polygon_area(outline) < 0) outline = outline.rowwise().reverse().eval();
    out.trials[0].cusick->outlines.push_back({number, outline});
  }
  return out;
}

}  // namespace

ImportedOutlines import_cusick(const OutlineImport& from) {
  if (!fs::exists(from.source)) refuse(from.source.string(), "is not there");
  if (from.source.extension() == ".csv") return of_csv(from);
  const Samples samples = read_samples(from);
  ImportedOutlines out;
  const double scale = px_per_m(from, samples, out.scale);
  out.mm_per_px = 1e3 / scale;
  for (const auto& [name, captures] : samples) {
    out.trials.push_back(disc_of(from, name));
    for (const Capture& c : captures)
      out.trials.back().cusick->outlines.push_back({c.number, at_most_720(c.outline_px / scale)});
    out.pictures.emplace_back(name, picture_of(from, captures.front(), scale));
  }
  return out;
}

}  // namespace selvedge::station
