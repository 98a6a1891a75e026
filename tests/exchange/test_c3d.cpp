// C3D files: what each kind of processor wrote reads as the same points, and a mapping makes a trial of them.
#include <filesystem>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "files/bad_input.h"
#include "files/whole_file.h"
#include "station/exchange/c3d_file.h"
#include "station/exchange/import_mapping.h"
#include "tests/exchange/c3d_writer.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;

// Two held corners and a dot over four frames, mm, y up; the dot is hidden in the second.
C3dTake small_take() {
  C3dTake take;
  take.labels = {"L", "corner R", "dot"};
  for (int p = 0; p < 3; ++p) {
    Eigen::Matrix3Xd x(3, 4);
    for (int f = 0; f < 4; ++f) x.col(f) << 150.5 * (p - 1) + f, -200.25 * (p == 2), 10 + 2.5 * f;
    take.position.push_back(x);
  }
  take.position[2].col(1).setConstant(std::nan(""));
  return take;
}

constexpr const char* kMapping = R"([trial]
name = "theirs"
kind = "waving"
[fabric]
name = "x"
width_m = 0.3
height_m = 0.3
mass_kg = 0.02
[markers]
c3d = "take.c3d"
labels = ["corner R", "dot"]
flat_m = [0.3, 0.0, 0.15, 0.2]
[corners]
left_label = "L"
right_label = "corner R"
[units]
axes = ["x", "-z", "y"]
)";

class C3d : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path mapped(const std::string& mapping, const C3dTake& take) {
    files::write_whole(folder_ / "take.c3d", c3d_of(take));
    files::write_whole(folder_ / "map.toml", mapping);
    return folder_ / "map.toml";
  }
  std::string refusal_of(const std::string& mapping, const C3dTake& take) {
    try {
      import_recording(mapped(mapping, take), folder_ / "out");
    } catch (const BadInput& error) {
      EXPECT_FALSE(fs::exists(folder_ / "out" / "theirs"));
      return error.what();
    }
    return "";
  }

  const fs::path folder_ = fs::temp_directory_path() / fmt::format("selvedge-c3d-{}", ::getpid());
};

TEST_F(C3d, EveryKindOfNumbersReadsAsTheSamePoints) {
  for (const int processor : {84, 85, 86})
    for (const double scale : {-1.0, 0.25})
      for (const int analogue : {0, 5}) {
        C3dTake take = small_take();
        take.processor = processor;
        take.scale = scale;
        take.analogue = analogue;
        take.first_frame = 17;
        const C3dPoints found = parse_c3d(c3d_of(take), "take.c3d");
        SCOPED_TRACE(fmt::format("processor {}, scale {}, {} analogue", processor, scale, analogue));
        EXPECT_EQ(found.labels, take.labels);
        EXPECT_EQ(found.unit, "mm");
        EXPECT_FLOAT_EQ(static_cast<float>(found.rate_hz), 100);
        for (size_t p = 0; p < 3; ++p)
          for (Eigen::Index f = 0; f < 4; ++f) {
            const Eigen::Vector3d x = take.position[p].col(f), y = found.position[p].col(f);
            EXPECT_EQ(x.hasNaN(), y.hasNaN());
            if (!x.hasNaN()) { EXPECT_LT((x - y).norm(), scale < 0 ? 1e-4 : 0.25); }
          }
      }
}

TEST_F(C3d, LabelsBecomeMarkersAndCorners) {
  const trial::Trial t = trial::read_trial(import_recording(mapped(kMapping, small_take()), folder_ / "out"));
  ASSERT_EQ(t.corners.time_s.size(), 4u);
  EXPECT_NEAR(t.corners.time_s[3], 0.03, 1e-9);
  // mm to m, and y up to z up.
  EXPECT_LT((t.corners.left.col(1) - Eigen::Vector3d(-0.1495, -0.0125, 0)).norm(), 1e-6);
  ASSERT_EQ(t.markers->marker, (std::vector<int>{0, 1, 0, 0, 1, 0, 1}));
  EXPECT_LT((t.markers->position.col(1) - Eigen::Vector3d(0.1505, -0.01, -0.20025)).norm(), 1e-6);
  EXPECT_EQ(t.markers->uv[1], Eigen::Vector2d(0.15, 0.2));
}

TEST_F(C3d, WhatDoesNotFitIsNamed) {
  const auto changed = [](std::string from, const std::string& what, const std::string& to) {
    return from.replace(from.find(what), what.size(), to);
  };
  EXPECT_NE(refusal_of(changed(kMapping, "\"dot\"", "\"spot\""), small_take()).find("expected one of"),
            std::string::npos);
  EXPECT_NE(refusal_of(changed(kMapping, ", 0.2]", "]"), small_take()).find("flat_m"), std::string::npos);
  EXPECT_NE(refusal_of(changed(kMapping, "left_label", "left_marker"), small_take()).find("left_label"),
            std::string::npos);
  C3dTake inches = small_take();
  inches.unit = "in";
  EXPECT_NE(refusal_of(kMapping, inches).find("expected mm, cm or m"), std::string::npos);
  const trial::Trial t = trial::read_trial(
      import_recording(mapped(changed(kMapping, "[units]", "[units]\nlength_m = 0.0254"), inches), folder_ / "out"));
  EXPECT_NEAR(t.corners.left(0, 0), -150.5 * 0.0254, 1e-6);
}

TEST_F(C3d, NothingIsReadBehindTheEnd) {
  const std::string whole = c3d_of(small_take());
  for (size_t length = 0; length < whole.size(); ++length)
    EXPECT_THROW(parse_c3d(whole.substr(0, length), "take.c3d"), BadInput) << length;
  EXPECT_NO_THROW(parse_c3d(whole, "take.c3d"));
  std::string other = whole;
  other[1] = 0;
  EXPECT_THROW(parse_c3d(other, "take.c3d"), BadInput);
  EXPECT_THROW(parse_c3d(std::string(1024, '\x50'), "take.c3d"), BadInput);
}

}  // namespace
}  // namespace selvedge::station
