#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "files/bad_input.h"
#include "rig/arm/model.h"
#include "rig/arm/plan.h"
#include "tests/refusal.h"

namespace selvedge::arm {
namespace {

ArmModel ur5e() { return ArmModel::read(SELVEDGE_SOURCE_DIR "/data/arms/ur5e.toml"); }

TEST(ArmModel, ZeroPosesAreAsPublished) {
  // UR5e stretched out: x = a2 + a3, y = −(d4 + d6) less the gripper along −y, z = d1 − d5.
  const Eigen::Vector3d tool = ur5e().base_from_tool(Eigen::VectorXd::Zero(6)).translation();
  EXPECT_LT((tool - Eigen::Vector3d(-0.8172, -0.2329 - 0.15, 0.0628)).norm(), 1e-9);
  // PA-10 straight up: the sum of its lengths.
  const auto pa10 = ArmModel::read(SELVEDGE_SOURCE_DIR "/data/arms/pa10.toml");
  EXPECT_LT((pa10.base_from_tool(Eigen::VectorXd::Zero(7)).translation() - Eigen::Vector3d(0, 0, 1.445)).norm(), 1e-9);
  EXPECT_NEAR(pa10.limits()[0].upper_rad, 177 * M_PI / 180, 1e-12);
}

TEST(ArmModel, ModifiedConventionTurnsTheSecondAxisSideways) {
  // PA-10 with S2 at 90 degrees lies flat along x: everything above the shoulder, at the shoulder's height.
  const auto pa10 = ArmModel::read(SELVEDGE_SOURCE_DIR "/data/arms/pa10.toml");
  Eigen::VectorXd q = Eigen::VectorXd::Zero(7);
  q[1] = M_PI / 2;
  EXPECT_LT((pa10.base_from_tool(q).translation() - Eigen::Vector3d(0.45 + 0.5 + 0.08 + 0.1, 0, 0.315)).norm(), 1e-9);
}

TEST(ArmModel, InverseUndoesForwardOnTheSameBranch) {
  for (const char* file : {"/data/arms/ur5e.toml", "/data/arms/pa10.toml"}) {
    const auto model = ArmModel::read(std::string(SELVEDGE_SOURCE_DIR) + file);
    Eigen::VectorXd q = model.home_rad();
    for (int i = 0; i < 50; ++i) {
      Eigen::Isometry3d pose = model.base_from_tool(model.home_rad());
      pose.translation() += Eigen::Vector3d(0.05 * std::sin(i * 0.3), 0.05 * std::cos(i * 0.3) - 0.05, 0.02 * std::sin(i * 0.1));
      const auto solved = model.inverse(pose, q);
      ASSERT_TRUE(solved) << file << " " << i;
      EXPECT_LT((model.base_from_tool(*solved).translation() - pose.translation()).norm(), 2e-6);
      EXPECT_LT((*solved - q).cwiseAbs().maxCoeff(), 0.2);
      q = *solved;
    }
    Eigen::Isometry3d far = model.base_from_tool(q);
    far.translation() += Eigen::Vector3d(5, 0, 0);
    EXPECT_FALSE(model.inverse(far, q));
  }
}

TEST(ArmModel, MistakesAreRefusedByName) {
  const auto path = std::filesystem::temp_directory_path() / "selvedge-arm.toml";
  const std::string head = "name = \"a\"\nconvention = \"standard\"\ntool_m = [0, 0, 0]\nhome_deg = [0]\n";
  const std::string joint = "[[joint]]\nlower_deg = -1\nupper_deg = 1\nspeed_deg_s = 1\nacceleration_deg_s2 = 1\n";
  const std::pair<std::string, std::string> cases[] = {
      {head, "[[joint]]"},
      {head + joint + "d_mm = 3\n", "d_mm"},
      {head + joint + joint, "home_deg"},
      {head + "[[joint]]\nlower_deg = 2\nupper_deg = 1\nspeed_deg_s = 1\nacceleration_deg_s2 = 1\n", "lower_deg"},
      {head + "[[joint]]\nlower_deg = -2\nupper_deg = 1\nspeed_deg_s = 0\nacceleration_deg_s2 = 1\n", "speed_deg_s"},
      {"name = \"a\"\nconvention = \"both\"\ntool_m = [0, 0, 0]\n", "convention"}};
  for (const auto& [text, word] : cases) {
    std::ofstream(path) << text;
    try {
      ArmModel::read(path);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const BadInput& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  }
  std::ofstream(path) << head + joint;
  EXPECT_NO_THROW(ArmModel::read(path));
  std::filesystem::remove(path);
}

class Plan : public testing::Test {
 protected:
  // Refusal text, empty where the path was accepted.
  std::string refusal(const ToolPath& path, const PlanLimits& limits = {}) const {
    return refusal_of([&] { plan(model_, model_.home_rad(), path, limits); });
  }
  ToolPath sinusoid(double amplitude_m, double frequency_hz, const Eigen::Vector3d& direction = Eigen::Vector3d::UnitX()) const {
    return make_sinusoid(start_m_, {.direction = direction, .amplitude_m = amplitude_m, .frequency_hz = frequency_hz, .duration_s = 6});
  }
  const ArmModel model_ = ur5e();
  const Eigen::Vector3d start_m_ = model_.base_from_tool(model_.home_rad()).translation();
};

TEST_F(Plan, FollowsAWavingPathToAMicrometreAndKeepsTheTool) {
  const ToolPath path = sinusoid(0.06, 1.2);
  const JointPath joints = plan(model_, model_.home_rad(), path, {});
  EXPECT_NEAR(joints.duration_s(), 6, 0.005);
  EXPECT_EQ(joints.q_rad.front(), model_.home_rad());
  const PathSpline spline(path);
  const Eigen::Matrix3d turn = model_.base_from_tool(model_.home_rad()).linear();
  double reached_m = 0;
  for (size_t i = 0; i < joints.q_rad.size(); ++i) {
    const Eigen::Isometry3d pose = model_.base_from_tool(joints.q_rad[i]);
    EXPECT_LT((pose.translation() - spline.at(JointPath::step_s * static_cast<double>(i))).norm(), 2e-6);
    EXPECT_TRUE(pose.linear().isApprox(turn, 1e-5));
    reached_m = std::max(reached_m, (pose.translation() - start_m_).norm());
  }
  EXPECT_NEAR(reached_m, 0.06, 0.002);
  // At rest at both ends.
  EXPECT_LT((joints.q_rad[1] - joints.q_rad[0]).norm(), 1e-4);
  EXPECT_LT((joints.q_rad.back() - joints.q_rad[joints.q_rad.size() - 2]).norm(), 1e-4);
}

TEST_F(Plan, SaysWhichLimitBreaksFirstAndWhen) {
  EXPECT_EQ(refusal(sinusoid(0.06, 1.2)), "");
  PlanLimits box;
  box.workspace_high_m.x() = start_m_.x() + 0.03;
  const std::string workspace = refusal(sinusoid(0.06, 1.2), box);
  EXPECT_NE(workspace.find("leaves the workspace: x"), std::string::npos) << workspace;
  // The path itself says when x first passes the box.
  const PathSpline spline(sinusoid(0.06, 1.2));
  double first_s = 0;
  while (spline.at(first_s).x() <= box.workspace_high_m.x()) first_s += JointPath::step_s;
  EXPECT_NE(workspace.find(fmt::format("at {:.3f} s", first_s)), std::string::npos) << workspace << " " << first_s;

  // Towards full stretch the joints hurry long before the reach ends, so only a jump gets there.
  ToolPath jump{{0, 0.004, 1}, start_m_.replicate(1, 3)};
  jump.point_m.col(1).z() += 1.5;
  EXPECT_NE(refusal(jump).find("out of reach"), std::string::npos) << refusal(jump);
  PlanLimits slow;
  slow.tool_speed_m_s = 0.2;
  const std::string speed = refusal(sinusoid(0.06, 1.2), slow);
  EXPECT_NE(speed.find("the tool moves at 0.2"), std::string::npos) << speed;
  const std::string joint = refusal(sinusoid(0.1, 4));
  EXPECT_NE(joint.find("accelerates at"), std::string::npos) << joint;

  PlanLimits apart;
  apart.corners = CornerDistance{start_m_ - Eigen::Vector3d(0.28, 0, 0), Eigen::Vector3d::Zero(), 0.3};
  const std::string corners = refusal(sinusoid(0.06, 1.2), apart);
  EXPECT_NE(corners.find("the corners are 0.30"), std::string::npos) << corners;
}

TEST_F(Plan, PathThatStartsElsewhereIsRefusedAndASmallDifferenceIsTakenOut) {
  ToolPath path = sinusoid(0.03, 1);
  path.point_m.colwise() += Eigen::Vector3d(0.002, 0, 0);
  const JointPath joints = plan(model_, model_.home_rad(), path, {});
  EXPECT_EQ(joints.q_rad.front(), model_.home_rad());
  EXPECT_LT((model_.base_from_tool(joints.q_rad.back()).translation() - path.point_m.rightCols<1>()).norm(), 2e-6);
  path.point_m.colwise() += Eigen::Vector3d(0.01, 0, 0);
  EXPECT_NE(refusal(path).find("at 0 s it begins"), std::string::npos);
}

TEST_F(Plan, SenselessPathsAreRefused) {
  ToolPath path = sinusoid(0.03, 1);
  ToolPath backwards = path;
  std::swap(backwards.time_s[10], backwards.time_s[11]);
  ToolPath nan = path;
  nan.point_m(1, 7) = std::nan("");
  ToolPath late = path;
  for (auto& t : late.time_s) t += 1;
  for (const auto& bad : {backwards, nan, late, ToolPath{}}) EXPECT_NE(refusal(bad), "");
  EXPECT_THROW(make_sinusoid(start_m_, {.duration_s = 2, .ramp_s = 1.5}), BadInput);
}

TEST(Path, RecordedPathIsRampedInAndOut) {
  ToolPath recorded = make_sinusoid({1, 2, 3}, {.amplitude_m = 0.1, .duration_s = 8, .ramp_s = 0.01});
  const ToolPath ramped = ramp_recorded(recorded, {0, 0, 1}, 1.5);
  EXPECT_EQ(ramped.point_m.col(0), Eigen::Vector3d(0, 0, 1));
  EXPECT_LT((ramped.point_m.rightCols<1>() - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12);
  for (long i = 0; i < ramped.point_m.cols(); ++i) {
    const double t = ramped.time_s[static_cast<size_t>(i)];
    if (t < 1.5 || t > 6.5) continue;
    EXPECT_LT((ramped.point_m.col(i) - Eigen::Vector3d(0, 0, 1) - (recorded.point_m.col(i) - recorded.point_m.col(0))).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace selvedge::arm
