// Files of points: each form of PLY, PCD and NPY reads as the same points, and a mapping makes a trial of them.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <liblzf/lzf.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "files/whole_file.h"
#include "station/exchange/import_mapping.h"
#include "station/exchange/points_file.h"
#include "station/exchange/points_import.h"
#include "tests/refusal.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;
using Eigen::Matrix3Xd;

// Exact as floats; the last was not seen.
Matrix3Xd three_points() {
  Matrix3Xd x(3, 3);
  x << 0.125, -2, std::nan(""), -0.25, 0.5, std::nan(""), 3, 1024, std::nan("");
  return x;
}

template <class Number>
std::string in_bytes(double value, bool is_big = false) {
  const auto number = static_cast<Number>(value);
  std::string bytes(reinterpret_cast<const char*>(&number), sizeof number);
  if (is_big) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

void expect_same(const std::vector<Matrix3Xd>& found, const Matrix3Xd& expected) {
  ASSERT_EQ(found.size(), 1u);
  ASSERT_EQ(found[0].cols(), expected.cols());
  for (Eigen::Index i = 0; i < expected.size(); ++i) {
    const double a = found[0](i), b = expected(i);
    EXPECT_TRUE(a == b || (std::isnan(a) && std::isnan(b))) << i << ": " << a << " for " << b;
  }
}

// Faces in front of the vertices, and a colour and normals about each.
std::string ply_of(const Matrix3Xd& x, const std::string& format, const std::string& end = "\n") {
  std::string out;
  for (const char* line : {"ply", "format FORMAT 1.0", "comment by hand", "element face 1",
                           "property list uchar int vertex_indices", "element vertex 3", "property uchar red",
                           "property double x", "property float y", "property float z", "end_header"})
    out += line + end;
  out.replace(out.find("FORMAT"), 6, format);
  const bool is_big = format == "binary_big_endian";
  if (format == "ascii") out += "3 0 1 2" + end;
  else out += in_bytes<uint8_t>(3) + in_bytes<int>(0, is_big) + in_bytes<int>(1, is_big) + in_bytes<int>(2, is_big);
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    if (format == "ascii") out += fmt::format("7 {} {} {}", x(0, i), x(1, i), x(2, i)) + end;
    else
      out += in_bytes<uint8_t>(7) + in_bytes<double>(x(0, i), is_big) + in_bytes<float>(x(1, i), is_big) +
             in_bytes<float>(x(2, i), is_big);
  }
  return out;
}

std::string pcd_of(const Matrix3Xd& x, const std::string& data) {
  std::string out =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS rgb x y z\nSIZE 4 4 8 4\nTYPE U F F F\nCOUNT 2 1 1 1\nWIDTH 3\n"
      "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA " +
      data + "\n";
  if (data == "ascii")
    for (Eigen::Index i = 0; i < x.cols(); ++i) out += fmt::format("1 2 {} {} {}\n", x(0, i), x(1, i), x(2, i));
  std::string rows, columns;
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    rows += std::string(8, '\1') + in_bytes<float>(x(0, i)) + in_bytes<double>(x(1, i)) + in_bytes<float>(x(2, i));
  columns = std::string(24, '\1');
  for (Eigen::Index i = 0; i < x.cols(); ++i) columns += in_bytes<float>(x(0, i));
  for (Eigen::Index i = 0; i < x.cols(); ++i) columns += in_bytes<double>(x(1, i));
  for (Eigen::Index i = 0; i < x.cols(); ++i) columns += in_bytes<float>(x(2, i));
  if (data == "binary") out += rows;
  if (data == "binary_compressed") {
    std::string packed(columns.size(), '\0');
    packed.resize(::lzf_compress(columns.data(), static_cast<unsigned>(columns.size()), packed.data(),
                                 static_cast<unsigned>(packed.size())));
    out += in_bytes<uint32_t>(static_cast<double>(packed.size())) +
           in_bytes<uint32_t>(static_cast<double>(columns.size())) + packed;
  }
  return out;
}

std::string npy_of(const std::string& descr, bool columns_first, const std::string& shape, const std::string& numbers) {
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': ({}), }}", descr,
                                   columns_first ? "True" : "False", shape);
  header.resize((header.size() + 11) / 64 * 64 + 64 - 11, ' ');
  header += '\n';
  return std::string("\x93NUMPY\x01") + '\0' + in_bytes<uint16_t>(static_cast<double>(header.size())) + header +
         numbers;
}

TEST(Points, EveryFormReadsAsTheSame) {
  const Matrix3Xd x = three_points();
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    SCOPED_TRACE(format);
    expect_same(parse_points(ply_of(x, format), ".ply", "a.ply"), x);
  }
  expect_same(parse_points(ply_of(x, "ascii", "\r\n"), ".ply", "a.ply"), x);
  for (const char* data : {"ascii", "binary", "binary_compressed"}) {
    SCOPED_TRACE(data);
    expect_same(parse_points(pcd_of(x, data), ".pcd", "a.pcd"), x);
  }
  std::string floats, big;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    floats += in_bytes<float>(x(i));
    big += in_bytes<double>(x(i), true);
  }
  expect_same(parse_points(npy_of("<f4", false, "3, 3", floats), ".npy", "a.npy"), x);
  expect_same(parse_points(npy_of(">f8", false, "1, 3, 3", big), ".npy", "a.npy"), x);
}

TEST(Points, AnArrayHoldsFramesInEitherOrder) {
  // Frame 2, row 3, column 2, axis 3: its number says its place.
  std::string rows_first, columns_first;
  const auto value = [](int f, int r, int c, int a) { return 1000 * f + 100 * r + 10 * c + a; };
  for (int f = 0; f < 2; ++f)
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 2; ++c)
        for (int a = 0; a < 3; ++a) rows_first += in_bytes<int16_t>(value(f, r, c, a));
  for (int a = 0; a < 3; ++a)
    for (int c = 0; c < 2; ++c)
      for (int r = 0; r < 3; ++r)
        for (int f = 0; f < 2; ++f) columns_first += in_bytes<int16_t>(value(f, r, c, a));
  for (const bool fortran : {false, true}) {
    const auto frames =
        parse_points(npy_of("<i2", fortran, "2, 3, 2, 3", fortran ? columns_first : rows_first), ".npy", "a.npy");
    ASSERT_EQ(frames.size(), 2u);
    ASSERT_EQ(frames[1].cols(), 6);
    EXPECT_EQ(frames[1].col(5), Eigen::Vector3d(value(1, 2, 1, 0), value(1, 2, 1, 1), value(1, 2, 1, 2)));
    EXPECT_EQ(frames[0].col(2), Eigen::Vector3d(value(0, 1, 0, 0), value(0, 1, 0, 1), value(0, 1, 0, 2)));
  }
}

TEST(Points, WhatIsCutShortOrOfAnotherKindIsRefused) {
  const Matrix3Xd x = three_points();
  const std::vector<std::pair<std::string, std::string>> whole = {
      {ply_of(x, "binary_little_endian"), ".ply"},
      {ply_of(x, "ascii"), ".ply"},
      {pcd_of(x, "binary"), ".pcd"},
      {pcd_of(x, "binary_compressed"), ".pcd"},
      {npy_of("<f4", false, "3, 3", std::string(36, '\0')), ".npy"}};
  for (const auto& [bytes, kind] : whole) {
    EXPECT_NO_THROW(parse_points(bytes, kind, "whole"));
    for (size_t length = 0; length + 2 < bytes.size(); ++length) {
      const std::string said = refusal_of([&] { parse_points(bytes.substr(0, length), kind, "cut" + kind); });
      EXPECT_NE(said.find("cut" + kind), std::string::npos) << kind << " of " << length << " bytes: " << said;
    }
  }
  const char* const header_alone = "ply\nformat ascii 1.0\nelement vertex 90000000\nend_header\n";
  EXPECT_NE(refusal_of([&] { parse_points(header_alone, ".ply", "a.ply"); }).find("is cut short"), std::string::npos);
  EXPECT_NE(refusal_of([] { parse_points("", ".xyz", "a.xyz"); }).find("expected .ply, .pcd or .npy"),
            std::string::npos);
  EXPECT_NE(refusal_of([] {
              parse_points(npy_of("<c8", false, "3, 3", std::string(72, '\0')), ".npy", "a");
            }).find("expected floats"),
            std::string::npos);
  EXPECT_NE(refusal_of([] {
              parse_points(npy_of("<f4", false, "3, 4", std::string(48, '\0')), ".npy", "a");
            }).find("points × 3"),
            std::string::npos);
}

constexpr const char* kPointMapping = R"([trial]
name = "theirs"
kind = "waving"
[fabric]
width_m = 0.3
height_m = 0.2
mass_kg = 0.02
[markers]
frames = "scans"
rate_hz = 50
grid = [2, 2]
[corners]
left_marker = 0
right_marker = 1
[units]
length_m = 0.001
)";

class PointFrames : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_ / "scans");
    for (int f = 0; f < 12; ++f) put_frame(f, 4);
    files::write_whole(folder_ / "scans" / ".hidden", "of the file manager");
  }
  void TearDown() override { fs::remove_all(folder_); }

  // Named so that a plain sort would put f10 before f2.
  void put_frame(int f, int points) {
    std::string text = fmt::format(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
        points);
    for (int p = 0; p < points; ++p)
      text += p == 3 && f == 5 ? "nan nan nan\n" : fmt::format("{} {} {}\n", 300 * (p % 2), f, -200 * (p / 2));
    files::write_whole(folder_ / "scans" / fmt::format("f{}.{}", f, f == 8 ? "PLY" : "ply"), text);
  }
  fs::path import(std::string mapping, const std::string& from = "", const std::string& to = "") {
    if (!from.empty()) mapping.replace(mapping.find(from), from.size(), to);
    files::write_whole(folder_ / "map.toml", mapping);
    return import_recording(folder_ / "map.toml", folder_ / "out");
  }

  const fs::path folder_ = fs::temp_directory_path() / fmt::format("selvedge-points-{}", ::getpid());
};

// Points that are others in every frame, and not as many.
TEST_F(PointFrames, BecomeASurface) {
  for (int f = 0; f < 12; ++f)
    if (f != 8) put_frame(f, 4 + f % 3);
  files::write_whole(folder_ / "corners.csv", "s,a,b,c,d,e,f\n0,0,0,0,300,0,0\n0.22,0,11,0,300,11,0\n");
  const std::string mapping =
      std::string(kPointMapping)
          .replace(std::string(kPointMapping).find("[markers]"), 9, "[surface]")
          .replace(std::string(kPointMapping).find("grid = [2, 2]"), 13, "seen_from_m = [0.1, -1, 0.5]");
  const std::string held =
      "file = \"corners.csv\"\ntime = \"s\"\nleft = [\"a\", \"b\", \"c\"]\nright = [\"d\", \"e\", \"f\"]";
  const trial::Trial t = trial::read_trial(import(mapping, "left_marker = 0\nright_marker = 1", held));
  ASSERT_TRUE(t.surface);
  EXPECT_FALSE(t.markers);
  size_t points = 0;
  for (int f = 0; f < 12; ++f) points += static_cast<size_t>(f == 8 ? 4 : 4 + f % 3);
  ASSERT_EQ(t.surface->time_s.size(), points - 1);  // one was not seen
  EXPECT_EQ(t.surface->time_s[4], 1.0 / 50);
  EXPECT_EQ(*t.surface->seen_from_m, Eigen::Vector3d(0.1, -1, 0.5));
  EXPECT_LT((t.surface->position.col(3) - Eigen::Vector3d(0.3, 0, -0.2)).norm(), 1e-9);
  fs::remove_all(folder_ / "out");
  EXPECT_NE(refusal_of([&] { import(mapping); }).find("left_marker: there are no markers"), std::string::npos);
}

TEST_F(PointFrames, BecomeMarkersInTheOrderOfTheirNumbers) {
  const trial::Trial t = trial::read_trial(import(kPointMapping));
  ASSERT_EQ(t.corners.time_s.size(), 12u);
  ASSERT_EQ(t.markers->marker.size(), 47u);  // one was not seen
  for (size_t i = 0; i < 12; ++i) {
    EXPECT_NEAR(t.corners.time_s[i], static_cast<double>(i) / 50, 1e-9);
    EXPECT_NEAR(t.corners.left(1, static_cast<Eigen::Index>(i)), 1e-3 * static_cast<double>(i), 1e-9);
  }
  EXPECT_EQ(t.markers->uv[3], Eigen::Vector2d(0.3, 0.2));
  EXPECT_LT((t.markers->position.col(3) - Eigen::Vector3d(0.3, 0, -0.2)).norm(), 1e-9);
}

TEST_F(PointFrames, SomeOfThemByPlacesAndTimesOfTheirOwn) {
  std::string times = "t\n";
  for (int f = 0; f < 12; ++f) times += fmt::format("{}\n", 3 + 0.02 * f);
  files::write_whole(folder_ / "times.csv", times);
  const trial::Trial t = trial::read_trial(
      import(kPointMapping, "rate_hz = 50\ngrid = [2, 2]",
             "times = \"times.csv\"\ntime = \"t\"\npoints = [0, 1, 2]\nflat_m = [0, 0, 0.3, 0, 0.0, 0.2]"));
  EXPECT_EQ(t.markers->marker.size(), 36u);
  EXPECT_NEAR(t.corners.time_s[1] - t.corners.time_s[0], 0.02, 1e-9);
  EXPECT_EQ(t.markers->uv[2], Eigen::Vector2d(0, 0.2));
}

TEST_F(PointFrames, WhatDoesNotFitIsNamed) {
  const auto said = [&](const std::string& from, const std::string& to) {
    const std::string out = refusal_of([&] { import(kPointMapping, from, to); });
    EXPECT_FALSE(fs::exists(folder_ / "out" / "theirs"));
    return out;
  };
  EXPECT_NE(said("[2, 2]", "[2, 3]").find("the 4 points of a frame"), std::string::npos);
  EXPECT_NE(said("rate_hz = 50", "rate_hz = 50\npoints = [4]").find("points"), std::string::npos);
  EXPECT_NE(said("\"scans\"", "\"nowhere\"").find("nowhere"), std::string::npos);
  put_frame(7, 5);
  const std::string changed = said("", "");
  EXPECT_NE(changed.find("f7.ply"), std::string::npos) << changed;
  EXPECT_NE(changed.find("found 5 points, expected 4"), std::string::npos) << changed;
}

}  // namespace
}  // namespace selvedge::station
