#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

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
      pose.translation() +=
          Eigen::Vector3d(0.05 * std::sin(i * 0.3), 0.05 * std::cos(i * 0.3) - 0.05, 0.02 * std::sin(i * 0.1));
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
  ToolPath sinusoid(double amplitude_m, double frequency_hz,
                    const Eigen::Vector3d& direction = Eigen::Vector3d::UnitX()) const {
    return make_sinusoid(
        start_m_, {.direction = direction, .amplitude_m = amplitude_m, .frequency_hz = frequency_hz, .duration_s = 6});
  }
  const ArmModel model_ = ur5e();
  const Eigen::Vector3d start_m_ = model_.base_from_tool(model_.home_rad()).translation();
};

TEST_F(Plan, FollowsAWavingPathToAMicrometreAndKeepsTheTool) {
  const ToolPath path = sinusoid(0.06, 1.2);
  const JointPath joints = plan(model_, model_.home_rad(), path, {});
  EXPECT_NEAR(joints.duration_s(), 6, 0.005);
  EXPECT_EQ(Eigen::VectorXd(joints.q_rad.col(0)), model_.home_rad());
  const PathSpline spline(path);
  const Eigen::Matrix3d turn = model_.base_from_tool(model_.home_rad()).linear();
  double reached_m = 0;
  for (long i = 0; i < joints.q_rad.cols(); ++i) {
    const Eigen::Isometry3d pose = model_.base_from_tool(joints.q_rad.col(i));
    EXPECT_LT((pose.translation() - spline.at(JointPath::step_s * static_cast<double>(i))).norm(), 2e-6);
    EXPECT_TRUE(pose.linear().isApprox(turn, 1e-5));
    reached_m = std::max(reached_m, (pose.translation() - start_m_).norm());
  }
  EXPECT_NEAR(reached_m, 0.06, 0.002);
  // At rest at both ends.
  EXPECT_LT((joints.q_rad.col(1) - joints.q_rad.col(0)).norm(), 1e-4);
  EXPECT_LT((joints.q_rad.rightCols<1>() - joints.q_rad.col(joints.q_rad.cols() - 2)).norm(), 1e-4);
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
  EXPECT_EQ(Eigen::VectorXd(joints.q_rad.col(0)), model_.home_rad());
  EXPECT_LT((model_.base_from_tool(joints.q_rad.rightCols<1>()).translation() - path.point_m.rightCols<1>()).norm(),
            2e-6);
  path.point_m.colwise() += Eigen::Vector3d(0.01, 0, 0);
  EXPECT_NE(refusal(path).find("at 0 s it begins"), std::string::npos);
}

// A number that is none lies in no box and below no limit.
TEST_F(Plan, WhatIsNotFiniteIsRefusedByItsName) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), huge = 1e308;
  const ToolPath good = make_sinusoid(start_m_, {.duration_s = 4});
  const auto refusal = [&](const ToolPath& path, const Eigen::VectorXd& from_rad, const PlanLimits& limits) {
    return refusal_of([&] { plan(model_, from_rad, path, limits); });
  };
  ToolPath spiked = good;
  spiked.point_m(2, 100) = huge;  // finite, and its spline's slopes are not
  spiked.point_m(2, 101) = -huge;
  EXPECT_NE(refusal(spiked, model_.home_rad(), {}), "");
  Eigen::VectorXd from_rad = model_.home_rad();
  from_rad[3] = nan;
  EXPECT_NE(refusal(good, from_rad, {}).find("joint angle that it starts from is not finite"), std::string::npos);
  PlanLimits limits;
  limits.corners = CornerDistance{Eigen::Vector3d(nan, 0, 0), Eigen::Vector3d::Zero(), 10};
  EXPECT_NE(refusal(good, model_.home_rad(), limits).find("fixed corner is not finite"), std::string::npos);
  limits = {};
  limits.world_from_base.translation().y() = nan;
  EXPECT_NE(refusal(good, model_.home_rad(), limits).find("pose of the arm's base is not finite"), std::string::npos);
  limits = {};
  limits.tool_speed_m_s = nan;
  EXPECT_NE(refusal(good, model_.home_rad(), limits).find("tool moves at"), std::string::npos);
}

TEST_F(Plan, EveryLinkKeepsToItsWorkspaceAndClearOfWhatStandsAbout) {
  const ToolPath path = make_sinusoid(start_m_, {.duration_s = 4});
  const auto refusal = [&](const PlanLimits& limits) {
    return refusal_of([&] { plan(model_, model_.home_rad(), path, limits); });
  };
  const std::vector<Eigen::Vector3d> points = model_.link_points(model_.home_rad());
  const Eigen::Vector3d elbow_m = points[2];
  PlanLimits limits;
  EXPECT_EQ(refusal(limits), "");
  // The elbow stands above the tool: a ceiling between the two is broken by the elbow alone.
  ASSERT_GT(elbow_m.z(), start_m_.z() + 0.1);
  limits.links_high_m.z() = 0.5 * (elbow_m.z() + start_m_.z());
  EXPECT_NE(refusal(limits).find("link 2 leaves the workspace: z"), std::string::npos) << refusal(limits);
  // A post beside the forearm, entered in the motion-capture frame of a base that stands turned and elsewhere.
  limits = {};
  limits.world_from_base.translation() << 1, 2, 3;
  limits.world_from_base.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d middle_m = limits.world_from_base * (0.5 * (points[2] + points[3]));
  const auto post = [&](double off_m) {
    Obstacle box{"post", middle_m, middle_m};
    box.low_m.head<2>().array() += off_m - 0.02;
    box.high_m.head<2>().array() += off_m + 0.02;
    box.low_m.z() -= 1;
    box.high_m.z() += 1;
    return box;
  };
  limits.obstacles = {post(0)};
  EXPECT_NE(refusal(limits).find("comes within 0.000 m of post"), std::string::npos) << refusal(limits);
  limits.obstacles = {post(1)};
  EXPECT_EQ(refusal(limits), "");
}

TEST_F(Plan, DistanceToABoxIsNeverTooLong) {
  const Obstacle box{"box", Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 1, 1)};
  const auto distance = [&](Eigen::Vector3d a, Eigen::Vector3d b) { return distance_to_box(a, b, box); };
  EXPECT_EQ(distance({-1, 0.5, 0.5}, {2, 0.5, 0.5}), 0);
  EXPECT_NEAR(distance({-1, 0.5, 1.2}, {2, 0.5, 1.2}), 0.2, 0.0051);
  EXPECT_LE(distance({-1, 0.5, 1.2}, {2, 0.5, 1.2}), 0.2);
  EXPECT_NEAR(distance({2, 2, 2}, {2, 2, 2}), std::sqrt(3), 0.0051);
}

TEST_F(Plan, AskedToGiveUpItDoesAtOnce) {
  std::stop_source asked;
  asked.request_stop();
  EXPECT_THROW(plan(model_, model_.home_rad(), make_sinusoid(start_m_, {.duration_s = 600}), {}, asked.get_token()),
               Cancelled);
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

}  // namespace
}  // namespace selvedge::arm
