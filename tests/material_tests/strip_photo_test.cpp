// Photographs rendered of strips of known rigidity: uneven light, noise, blur, JPEG; the strip that stands in them is
// simulated by other equations than those of the fit.
#include "material_tests/strip_photo.h"

#include <random>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <unistd.h>

#include "cli/verify/proofs/strip_of_nodes.h"
#include "material_tests/cantilever.h"
#include "tests/refusal.h"

namespace selvedge::material_tests {
namespace {

namespace fs = std::filesystem;

struct Scene {
  double mm_per_px = 0.15, overhang_m = 0.045, thickness_px = 5, roll_deg = 0, noise = 6, blur_px = 1.2;
  int strip_grey = 60, table_grey = 90, ground_grey = 190;
  bool to_left = false, has_table = true;
};

constexpr double kDensity = 0.19;
const BendingLaw kLaw{1.6e-5, -2.5e-8};

// 1000 × 700 px; the table's edge at column 350, row 200.
cv::Mat rendered(const Scene& s, unsigned seed) {
  constexpr int kFine = 4;
  cv::Mat fine(700 * kFine, 1000 * kFine, CV_32F);
  for (int y = 0; y < fine.rows; ++y)
    for (int x = 0; x < fine.cols; ++x) {
      const double u = static_cast<double>(x) / fine.cols - 0.3, v = static_cast<double>(y) / fine.rows - 0.4;
      fine.at<float>(y, x) = static_cast<float>(s.ground_grey * (1 - 0.25 * (u * u + v * v) - 0.15 * u));
    }
  const double roll = s.roll_deg * M_PI / 180;
  const auto px = [&](double along, double down) {
    const double x = along * std::cos(roll) - down * std::sin(roll), y = along * std::sin(roll) + down * std::cos(roll);
    return cv::Point(static_cast<int>(kFine * 16 * (350.5 + x)), static_cast<int>(kFine * 16 * (200.5 + y)));
  };
  if (s.has_table) {
    const std::vector<cv::Point> block = {px(0, s.thickness_px / 2), px(0, 600), px(-500, 600),
                                          px(-500, s.thickness_px / 2)};
    cv::fillConvexPoly(fine, block, cv::Scalar(s.table_grey), cv::LINE_8, 4);
  }
  const Eigen::Matrix2Xd line = cli::strip_of_nodes(kLaw, 9.81 * kDensity, s.overhang_m, 600);
  std::vector<Eigen::Vector2d> middle = {{-500, 0}};
  for (Eigen::Index i = 0; i < line.cols(); ++i) middle.push_back(1e3 / s.mm_per_px * line.col(i));
  std::vector<cv::Point> outline(2 * middle.size());
  for (size_t i = 0; i < middle.size(); ++i) {
    const Eigen::Vector2d along =
        (middle[std::min(i + 1, middle.size() - 1)] - middle[i == 0 ? 0 : i - 1]).normalized();
    const Eigen::Vector2d out = s.thickness_px / 2 * Eigen::Vector2d(-along.y(), along.x());
    outline[i] = px(middle[i].x() + out.x(), middle[i].y() + out.y());
    outline[2 * middle.size() - 1 - i] = px(middle[i].x() - out.x(), middle[i].y() - out.y());
  }
  cv::fillPoly(fine, std::vector<std::vector<cv::Point>>{outline}, cv::Scalar(s.strip_grey), cv::LINE_8, 4);
  cv::Mat grey, noise(700, 1000, CV_32F), bytes;
  cv::resize(fine, grey, {1000, 700}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(grey, grey, {0, 0}, s.blur_px);
  cv::RNG random(seed);
  random.fill(noise, cv::RNG::NORMAL, 0, s.noise);
  grey += noise;
  if (s.to_left) cv::flip(grey, grey, 1);
  grey.convertTo(bytes, CV_8U);
  return bytes;
}

class StripPhoto : public testing::Test {
 protected:
  void TearDown() override { fs::remove(photo_); }

  StripInPhoto found(const Scene& s, std::optional<Eigen::Vector2d> edge = {}) {
    cv::imwrite(photo_.string(), rendered(s, 7), {cv::IMWRITE_JPEG_QUALITY, 85});
    return find_strip(photo_, {s.mm_per_px, edge});
  }

  static Answer fitted(const StripInPhoto& strip) {
    trial::Trial t;
    t.experiment = trial::Experiment::cantilever;
    t.fabric = {"made up", 0.025, 0.2, kDensity * 0.025 * 0.2, true};
    t.cantilever = trial::Cantilever{0, strip.overhang_m, std::nullopt, strip.midline_m};
    return fit_cantilever({&t});
  }

  const fs::path photo_ = fs::temp_directory_path() / fmt::format("selvedge-strip-{}.jpg", ::getpid());
};

double instrument_mm(const Answer& answer) {
  for (const Reported& r : answer.reported)
    if (r.name == "bending length by ISO 9073-7 warp") return r.value;
  return 0;
}

// Within what a photograph of this grain shows: 1 % of the instrument's bending length.
void expect_found(const StripInPhoto& strip, const Scene& s) {
  EXPECT_NEAR(strip.overhang_m / s.overhang_m, 1, 0.01);
  const Eigen::Matrix2Xd truth = cli::strip_of_nodes(kLaw, 9.81 * kDensity, s.overhang_m, 600);
  const Eigen::Index last = strip.midline_m.cols() - 1;
  EXPECT_LT((strip.midline_m.col(last) - truth.col(600)).norm(), 4e-3 * s.mm_per_px);
}

TEST_F(StripPhoto, GivesTheStripsBendingBack) {
  const Scene s;
  const StripInPhoto strip = found(s);
  expect_found(strip, s);
  const Answer answer = fitted(strip);
  const double truth = 1e3 * instrument_bending_length(kLaw, 9.81 * kDensity).value();
  EXPECT_NEAR(instrument_mm(answer) / truth, 1, 0.01);
  const auto [low, high] = interval_of(answer, 0);
  EXPECT_LT(low, kLaw.bend);
  EXPECT_GT(high, kLaw.bend);
  EXPECT_LT(high / low, 2);
  EXPECT_EQ(strip.picture.cols, 1000);
}

TEST_F(StripPhoto, TakesItAsLabsPhotographIt) {
  Scene left, roll, thin, bright, noisy, open;
  left.to_left = true;
  roll.roll_deg = 1.5;
  thin.thickness_px = 3;
  bright.strip_grey = 235;
  bright.table_grey = 220;
  bright.ground_grey = 110;
  noisy.noise = 15;
  noisy.blur_px = 2;
  open.has_table = false;
  const double truth = 1e3 * instrument_bending_length(kLaw, 9.81 * kDensity).value();
  for (const Scene* s : {&left, &roll, &thin, &bright, &noisy, &open}) {
    SCOPED_TRACE(testing::Message() << "thickness " << s->thickness_px << ", noise " << s->noise << ", roll "
                                    << s->roll_deg);
    const StripInPhoto strip = found(*s, s == &open ? std::optional(Eigen::Vector2d(350, 200)) : std::nullopt);
    expect_found(strip, *s);
    EXPECT_NEAR(instrument_mm(fitted(strip)) / truth, 1, 0.02);
    EXPECT_NEAR(strip.roll_deg, s == &roll ? -1.5 : 0, 0.3);
  }
}

TEST_F(StripPhoto, WhatShowsNoStripIsRefused) {
  cv::imwrite(photo_.string(), cv::Mat(300, 400, CV_8U, cv::Scalar(120)));
  EXPECT_NE(refusal_of([&] { find_strip(photo_, {0.1, {}}); }).find(photo_.string()), std::string::npos);
  Scene open;
  open.has_table = false;
  EXPECT_NE(refusal_of([&] { found(open); }).find("--edge-px"), std::string::npos);
  EXPECT_NE(refusal_of([&] { find_strip("/nowhere.jpg", {0.1, {}}); }).find("no picture"), std::string::npos);
}

}  // namespace
}  // namespace selvedge::material_tests
