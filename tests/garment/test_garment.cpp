// Patterns, seams, recorded motion, and a skirt that is worn.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "cloth/contact/intersections.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "garment/bvh.h"
#include "garment/sewing.h"
#include "garment/synthetic_walk.h"
#include "garment/wear.h"
#include "tests/refusal.h"

namespace selvedge::garment {
namespace {

namespace fs = std::filesystem;

class Garments : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path file(const std::string& name, const std::string& text) const {
    files::write_whole(folder_ / name, text);
    return folder_ / name;
  }
  std::string refusal(const std::string& name, const std::string& text) const {
    const fs::path path = file(name, text);
    return refusal_of([&] {
      if (path.extension() == ".bvh") read_bvh(path);
      else sew(read_pattern(path));
    });
  }
  fs::path folder_ = fs::temp_directory_path() / ("selvedge_garment_" + std::to_string(::getpid()));
};

// Bending energy of the sheet as it stands.
double bend_energy(const cloth::Sheet& sheet, const Eigen::Matrix3Xd& x, double bend) {
  const auto& q = sheet.data.bend_matrix;
  double sum = 0;
  for (int i = 0; i < sheet.data.vertex_count; ++i)
    for (int k = q.start[size_t(i)]; k < q.start[size_t(i) + 1]; ++k)
      sum += q.value[size_t(k)] * x.col(i).dot(x.col(q.index[size_t(k)]));
  return 0.5 * bend * sum;
}

TEST_F(Garments, SkirtStandsWithoutStretchAndBendsAcrossSeamsLikeOneCloth) {
  // A tube: its bending energy is that of a cylinder, whatever it is sewn from.
  for (const int panels : {1, 2, 4}) {
    const double around = 0.8, length = 0.4;
    const Garment tube = sew(make_gored_skirt(panels, around, around, length, 0.02));
    const double radius = around / (2 * M_PI), expected = 0.5 * 1e-4 / (radius * radius) * around * length;
    EXPECT_NEAR(bend_energy(tube.sheet, tube.standing, 1e-4), expected, 0.02 * expected) << panels << " panels";
  }
  const Garment skirt = sew(make_gored_skirt(4, 0.72, 1.6, 0.6, 0.02));
  for (const auto& t : skirt.sheet.data.triangles) {
    Eigen::Vector3d u = Eigen::Vector3d::Zero(), v = u;
    for (int a = 0; a < 3; ++a) {
      u += t.gradient_u[a] * skirt.standing.col(t.vertex[a]);
      v += t.gradient_v[a] * skirt.standing.col(t.vertex[a]);
    }
    EXPECT_NEAR(u.norm(), 1, 0.02);
    EXPECT_NEAR(v.norm(), 1, 0.02);
    EXPECT_NEAR(u.dot(v), 0, 0.03);
  }
  const double angle = (1.6 - 0.72) / 4 / 0.6, inner = 0.72 / 4 / angle;
  double area = 0;
  for (const double a : skirt.sheet.data.vertex_area) area += a;
  EXPECT_NEAR(area, 4 * angle / 2 * ((inner + 0.6) * (inner + 0.6) - inner * inner), 0.005 * area);
  EXPECT_TRUE(cloth::contact::intersecting_triangles(skirt.surface, skirt.standing).empty());
}

const char* const kSkirt = R"({"format": "garment/1", "spacing_m": 0.03, "fabric": {"density": 0.2, "bend": 1e-4},
 "panels": [{"name": "front", "gore": {"top_m": 0.36, "bottom_m": 0.8, "length_m": 0.6}},
            {"name": "back", "top": [[0, 0], [0.36, 0]], "bottom": [[-0.2, 0.55], [0.56, 0.55]]}],
 "seams": [{"sew": ["front.right", "back.left"]}, {"sew": ["back.right", "front.left"]}],
 "held": ["front.top", "back.top"], "held_by": "Hips", "held_above_m": 0.1})";

std::string changed(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST_F(Garments, PatternsAreReadAndFaultsNamed) {
  const Pattern pattern = read_pattern(file("skirt.json", kSkirt));
  EXPECT_EQ(pattern.panels.size(), 2u);
  EXPECT_EQ(pattern.fabric.density, 0.2);
  EXPECT_LT(std::abs(pattern.seams[0].ease), 0.05);
  EXPECT_GT(sew(pattern).held.size(), 20u);
  EXPECT_NE(refusal("a.json", changed(kSkirt, "\"spacing_m\"", "\"spacing\"")).find("spacing"), std::string::npos);
  EXPECT_NE(refusal("a.json", changed(kSkirt, "back.left", "hind.left")).find("hind.left"), std::string::npos);
  EXPECT_NE(refusal("a.json", changed(kSkirt, "0.55], [0.56", "1.55], [0.56")).find("lengths"), std::string::npos);
  EXPECT_NE(refusal("a.json", changed(kSkirt, "back.left", "back.right")).find("sewn"), std::string::npos);
  EXPECT_NE(refusal("a.json", changed(kSkirt, "\"bend\"", "\"bendy\"")).find("bendy"), std::string::npos);
}

TEST_F(Garments, FabricOfAFitIsTaken) {
  file("fit.json", R"({"format": "fit/1", "parameters": {"bend": {"value": 7e-5}, "stretch": {"value": 42}}})");
  const Pattern pattern = read_pattern(file("skirt.json", changed(kSkirt, "\"bend\": 1e-4", "\"fit\": \"fit.json\"")));
  EXPECT_EQ(pattern.fabric.bend, 7e-5);
  EXPECT_EQ(pattern.fabric.stretch, 42);
  EXPECT_EQ(pattern.fabric.density, 0.2);
}

const char* const kMotion = R"(HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Knee
  {
    OFFSET 0 -40 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -40 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.1
0 90 0 0 0 0 0 0 0
10 90 0 0 90 0 0 0 0
20 90 0 0 0 90 90 0 0
)";

TEST_F(Garments, MotionIsPlacedAsItsChannelsSay) {
  const Motion motion = read_bvh(file("a.bvh", kMotion));
  ASSERT_EQ(motion.joints.size(), 3u);
  EXPECT_EQ(motion.joints[2].name, "Knee-end");
  EXPECT_DOUBLE_EQ(motion.duration_s(), 0.2);
  // z up: (x, y, z) of the file is (x, −z, y) here.
  const auto first = pose_at(motion, 0, 1), second = pose_at(motion, 0.1, 1), third = pose_at(motion, 0.2, 1);
  EXPECT_LT((first[2].translation() - Eigen::Vector3d(0, 0, 0.1)).norm(), 1e-9);
  // 90° about x takes the leg, down in the file, to its −z.
  EXPECT_LT((second[2].translation() - Eigen::Vector3d(0.1, 0.8, 0.9)).norm(), 1e-9);
  // The knee's 90° about z takes the shin to the file's +x, the root's 90° about y from there to its −z.
  EXPECT_LT((third[2].translation() - Eigen::Vector3d(0.2, 0.4, 0.5)).norm(), 1e-9);
  EXPECT_LT((pose_at(motion, 5, 1)[2].translation() - third[2].translation()).norm(), 1e-12);
  // From rest: no speed at the start of the run-up, the motion's own speed at its end.
  const auto speed = [&](double t) {
    return (pose_at(motion, t + 1e-5, 1)[0].translation() - pose_at(motion, t - 1e-5, 1)[0].translation()).norm() /
           2e-5;
  };
  EXPECT_NEAR(speed(-0.99), 0.01, 1e-3);
  EXPECT_NEAR(speed(-0.001), 1, 2e-3);
  EXPECT_NEAR(speed(0.001), 1, 2e-3);
}

TEST_F(Garments, DamagedMotionIsRefusedWithItsLine) {
  EXPECT_EQ(refusal("a.bvh", kMotion), "");
  EXPECT_NE(refusal("a.bvh", changed(kMotion, "Xposition", "Wposition")).find("a.bvh:5"), std::string::npos);
  EXPECT_NE(refusal("a.bvh", "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\n}\nMOTION\nFrames: 9999999\nFrame Time: 0.1\n")
                .find("a.bvh:5: found no CHANNELS at any joint, expected some that move"),
            std::string::npos);
  EXPECT_NE(refusal("a.bvh", changed(kMotion, "10 90 0", "10 x 0")).find("a.bvh:20"), std::string::npos);
  EXPECT_NE(refusal("a.bvh", changed(kMotion, "Frames: 3", "Frames: 4")).find("end of the file"), std::string::npos);
  EXPECT_NE(refusal("a.bvh", changed(kMotion, "Frames: 3", "Frames: 2")).find("expected the end"), std::string::npos);
  EXPECT_NE(refusal("a.bvh", changed(kMotion, "Frame Time: 0.1", "Frame Time: 0")).find("frame time"),
            std::string::npos);
  EXPECT_NE(refusal("a.bvh", "BVH").find("HIERARCHY"), std::string::npos);
  for (size_t cut = 0; cut + 40 < std::string(kMotion).size(); cut += 7)
    EXPECT_NE(refusal("a.bvh", std::string(kMotion).substr(0, cut)), "") << "cut after " << cut;
}

TEST_F(Garments, AMotionThatWouldTakeAllStackOrMemoryIsRefused) {
  std::string deep = "HIERARCHY\nROOT a\n{\n";
  for (int i = 0; i < 1 << 18; ++i) deep += "JOINT b\n{\n";
  EXPECT_NE(refusal("a.bvh", deep).find("joints nested deeper than 128"), std::string::npos);
  EXPECT_NE(refusal("a.json", changed(kSkirt, "\"spacing_m\": 0.03", "\"spacing_m\": 1e-9")).find("vertices"),
            std::string::npos);
  // Joints without channels take no number of the file, however many frames it announces.
  EXPECT_NE(
      refusal(
          "a.bvh",
          "HIERARCHY\nROOT a\n{\nCHANNELS 1 Xposition\nEnd Site\n{\n}\n}\nMOTION\nFrames: 9999999\nFrame Time: 0.1\n")
          .find("9999999 frames of 2 joints"),
      std::string::npos);
}

TEST_F(Garments, ExamplesAreWhatTheDocumentsSay) {
  const fs::path examples = fs::path(SELVEDGE_SOURCE_DIR) / "examples";
  EXPECT_EQ(files::read_whole(examples / "walk.bvh"), synthetic_walk(10));
  const Pattern pattern = read_pattern(examples / "skirt.json");
  EXPECT_EQ(pattern.panels.size(), 4u);
  EXPECT_GT(sew(pattern).held.size(), 30u);
  joint_index(read_bvh(examples / "walk.bvh"), pattern.held_by, "skirt.json");
}

TEST_F(Garments, ASkirtIsWornWithoutPassingThroughItself) {
  const auto motion = std::make_shared<const Motion>(read_bvh(file("walk.bvh", synthetic_walk(1.2))));
  Pattern pattern = make_gored_skirt(4, 0.72, 1.6, 0.55, 0.03);
  pattern.held_above_m = 0.1;
  const Garment skirt = sew(pattern);
  const Worn worn = wear(pattern, skirt, {motion, walker_limbs(), 0.8}, {.duration_s = 1.2});
  std::printf("%zu triangles, %.2f s for %.2f s, %ld steps, strain %.3f, %.2f mm in the body, impacts %ld, zones %ld\n",
              skirt.surface.triangles.size(), worn.wall_s, worn.simulated_s, worn.contact.steps, worn.largest_strain,
              1e3 * worn.deepest_in_body_m, worn.contact.impacts, worn.contact.zone_steps);
  ASSERT_TRUE(worn.finite);
  ASSERT_EQ(worn.frames.size(), 37u);
  EXPECT_EQ(worn.frames_that_intersect, 0);
  EXPECT_EQ(worn.contact.unresolved, 0);
  EXPECT_LT(worn.deepest_in_body_m, 0.004);
  // The waist went along: 1.1 m/s.
  const Eigen::Vector3d gone = worn.frames.back().col(skirt.held[0]) - worn.frames.front().col(skirt.held[0]);
  EXPECT_NEAR(gone.norm(), 1.1 * 1.2, 0.08);
}

}  // namespace
}  // namespace selvedge::garment
