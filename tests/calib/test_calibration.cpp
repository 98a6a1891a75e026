// The solver against made-up poses whose truth is known, and the verdict on poses that should not pass.
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "calib/calibration.h"
#include "calib/calibration_file.h"
#include "hardware_sim/synthetic_grid/synthetic_poses.h"
#include "files/bad_input.h"

namespace selvedge::calib {
namespace {

Options quick() {
  Options options;
  options.device.leave_one_pose_out = false;
  return options;
}

bool says(const Calibration& calibration, const std::string& text) {
  return calibration.advice.find(text) != std::string::npos;
}

TEST(calibration, without_noise_is_exact) {
  hardware_sim::SyntheticOptions made;
  made.poses = 6;
  made.tracker_noise_m = made.camera_noise_px = made.projector_noise_px = 0;
  const hardware_sim::SyntheticPoses truth = hardware_sim::make_synthetic_poses(made);
  const Calibration calibration = calibrate(truth.poses, quick());
  EXPECT_LT(hardware_sim::volume_error_px(calibration.camera.projection(), truth.camera, truth.poses), 1e-5);
  EXPECT_LT(hardware_sim::volume_error_px(calibration.projector->projection(), truth.projector, truth.poses), 1e-5);
}

TEST(calibration, of_twelve_poses_is_good_and_leaves_the_unseen_pose_near_the_training_residual) {
  const hardware_sim::SyntheticPoses truth = hardware_sim::make_synthetic_poses({});
  const Calibration calibration = calibrate(truth.poses);
  EXPECT_EQ(calibration.verdict, Verdict::good) << calibration.advice;
  EXPECT_LT(hardware_sim::volume_error_px(calibration.camera.projection(), truth.camera, truth.poses), 0.12);
  EXPECT_LT(hardware_sim::volume_error_px(calibration.projector->projection(), truth.projector, truth.poses), 0.15);
  EXPECT_GT(calibration.camera.solution.leave_one_pose_out_px, calibration.camera.solution.rms_px);
  EXPECT_LT(calibration.camera.solution.leave_one_pose_out_px, 1.2 * calibration.camera.solution.rms_px);
  EXPECT_NEAR(calibration.camera.solution.refined.pixel_sd_px, 0.2, 0.04);
}

TEST(calibration, names_every_swapped_label_and_only_those) {
  hardware_sim::SyntheticOptions made;
  made.swapped_share = 0.2;
  const hardware_sim::SyntheticPoses truth = hardware_sim::make_synthetic_poses(made);
  std::set<std::pair<int, int>> swapped, rejected;
  for (const Correspondence& row : truth.poses.rows) {
    const Eigen::Vector2d expected = geometry::project(truth.camera, row.position);
    if (row.camera && (*row.camera - expected).norm() > 5) swapped.emplace(row.pose, row.marker);
  }
  ASSERT_EQ(swapped.size(), 72u);
  const Calibration calibration = calibrate(truth.poses, quick());
  for (const RejectedSighting& r : calibration.rejected) rejected.emplace(r.pose, r.marker);
  EXPECT_EQ(rejected, swapped);
  EXPECT_EQ(calibration.verdict, Verdict::good) << calibration.advice;
  EXPECT_TRUE(says(calibration, "label")) << calibration.advice;
  EXPECT_LT(hardware_sim::volume_error_px(calibration.camera.projection(), truth.camera, truth.poses), 0.15);
}

TEST(calibration, refuses_a_single_pose_though_its_training_residual_is_small) {
  hardware_sim::SyntheticOptions made;
  made.poses = 1;
  const Calibration calibration = calibrate(hardware_sim::make_synthetic_poses(made).poses);
  EXPECT_EQ(calibration.verdict, Verdict::refused);
  EXPECT_TRUE(says(calibration, "single pose")) << calibration.advice;
  EXPECT_LT(calibration.camera.solution.rms_px, 0.6);
}

TEST(calibration, refuses_a_flat_grid_in_one_pose_and_in_many) {
  hardware_sim::SyntheticOptions made;
  made.grid.fold_rad = 0;
  const Calibration many = calibrate(hardware_sim::make_synthetic_poses(made).poses, quick());
  EXPECT_EQ(many.verdict, Verdict::refused);
  EXPECT_TRUE(says(many, "flat")) << many.advice;
  made.poses = 1;
  const Calibration one = calibrate(hardware_sim::make_synthetic_poses(made).poses, quick());
  EXPECT_EQ(one.verdict, Verdict::refused);
  EXPECT_FALSE(one.camera.solution.solved);
  EXPECT_TRUE(says(one, "plane")) << one.advice;
  EXPECT_TRUE(to_json(one)["camera"]["projection"].is_null());
}

class KnockedCamera : public ::testing::TestWithParam<int> {};
TEST_P(KnockedCamera, is_found_between_the_right_poses) {
  hardware_sim::SyntheticOptions made;
  made.knocked_pose = GetParam();
  const hardware_sim::SyntheticPoses truth = hardware_sim::make_synthetic_poses(made);
  const Calibration calibration = calibrate(truth.poses, quick());
  ASSERT_EQ(calibration.camera.solution.events.size(), 1u) << calibration.advice;
  const PoseEvent& event = calibration.camera.solution.events[0];
  EXPECT_TRUE(event.knocked);
  EXPECT_EQ(event.pose, GetParam());
  EXPECT_NEAR(event.shift.head<3>().norm() * 180 / M_PI, 0.5, 0.15);
  EXPECT_TRUE(calibration.projector->solution.events.empty());
  EXPECT_EQ(calibration.verdict, Verdict::doubtful) << calibration.advice;
  // The matrix is the camera's as it stands now.
  EXPECT_LT(hardware_sim::volume_error_px(calibration.camera.projection(), truth.camera, truth.poses), 0.4);
}
INSTANTIATE_TEST_SUITE_P(at, KnockedCamera, ::testing::Values(2, 5, 8, 10));

TEST(calibration, a_board_that_moved_is_left_out_and_named) {
  for (const double moved_m : {0.004, 0.06}) {
    hardware_sim::SyntheticOptions made;
    made.moved_pose = 5;
    made.moved_m = Eigen::Vector3d(moved_m, 0, 0);
    const hardware_sim::SyntheticPoses truth = hardware_sim::make_synthetic_poses(made);
    const Calibration calibration = calibrate(truth.poses, quick());
    ASSERT_EQ(calibration.camera.solution.events.size(), 1u) << calibration.advice;
    EXPECT_FALSE(calibration.camera.solution.events[0].knocked);
    EXPECT_EQ(calibration.camera.solution.events[0].pose, 5);
    EXPECT_EQ(calibration.camera.solution.worst_pose, 5);
    EXPECT_TRUE(says(calibration, "Pose 5")) << calibration.advice;
    EXPECT_LT(hardware_sim::volume_error_px(calibration.camera.projection(), truth.camera, truth.poses), 0.12);
  }
}

TEST(calibration, a_camera_knocked_before_the_last_pose_does_not_pass_for_good) {
  hardware_sim::SyntheticOptions made;
  made.knocked_pose = 11;
  const Calibration calibration = calibrate(hardware_sim::make_synthetic_poses(made).poses, quick());
  EXPECT_EQ(calibration.verdict, Verdict::doubtful) << calibration.advice;
}

TEST(calibration, clean_draws_raise_no_false_alarm) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    hardware_sim::SyntheticOptions made;
    made.seed = 1000 + seed;
    const Calibration calibration = calibrate(hardware_sim::make_synthetic_poses(made).poses, quick());
    EXPECT_EQ(calibration.verdict, Verdict::good) << calibration.advice;
    EXPECT_TRUE(calibration.camera.solution.events.empty()) << calibration.advice;
    EXPECT_LE(calibration.rejected.size(), 2u);
  }
}

TEST(calibration, refuses_poses_without_a_camera_pixel) {
  Poses poses = hardware_sim::make_synthetic_poses({}).poses;
  for (Correspondence& row : poses.rows) row.camera.reset();
  EXPECT_THROW(calibrate(poses), BadInput);
}

TEST(calibration, file_carries_what_it_takes_to_solve_it_again) {
  hardware_sim::SyntheticOptions made;
  made.poses = 5;
  const Calibration calibration = calibrate(hardware_sim::make_synthetic_poses(made).poses, quick());
  const nlohmann::json file = to_json(calibration);
  const Calibration again = calibrate(poses_from_json(file["inputs"], "inputs"), quick());
  EXPECT_EQ(again.camera.projection().matrix, calibration.camera.projection().matrix);
  for (const char* key :
       {"projection", "distortion", "rms_px", "leave_one_pose_out_px", "predicted_sd_px", "worst_pose"})
    EXPECT_TRUE(file["camera"].contains(key) && file["projector"].contains(key)) << key;
}

}  // namespace
}  // namespace selvedge::calib
