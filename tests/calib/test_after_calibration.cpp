// What is done with a solved calibration: exports, the next pose, drift.
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <random>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "calib/calibration.h"
#include "calib/calibration_file.h"
#include "calib/calibration_report.h"
#include "calib/drift.h"
#include "calib/export.h"
#include "calib/next_pose.h"
#include "hardware_sim/synthetic_grid/synthetic_poses.h"
#include "files/whole_file.h"
#include "tests/keep_page.h"

extern "C" {
#include <mrcal/mrcal.h>
}

namespace selvedge::calib {
namespace {

class AfterCalibration : public ::testing::Test {
 protected:
  static const Calibration& solved(int poses) {
    static std::map<int, Calibration> cache;
    if (!cache.contains(poses)) {
      hardware_sim::SyntheticOptions made;
      made.poses = poses;
      cache[poses] = calibrate(hardware_sim::make_synthetic_poses(made).poses);
    }
    return cache[poses];
  }
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("selvedge_after_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

TEST_F(AfterCalibration, file_comes_back_with_matrices_and_inputs) {
  write_calibration(solved(5), folder_ / "calibration.json");
  const StoredCalibration stored = read_calibration(folder_ / "calibration.json");
  EXPECT_EQ(stored.camera.matrix, solved(5).camera.projection().matrix);
  EXPECT_EQ(stored.projector->distortion, solved(5).projector->projection().distortion);
  EXPECT_EQ(stored.inputs->rows.size(), 150u);
}

TEST_F(AfterCalibration, opencv_reads_its_yaml) {
  export_opencv_yaml(solved(5).camera.projection(), folder_ / "camera.yaml");
  cv::FileStorage storage((folder_ / "camera.yaml").string(), cv::FileStorage::READ);
  cv::Mat matrix, distortion, rvec, projection;
  storage["camera_matrix"] >> matrix;
  storage["distortion_coefficients"] >> distortion;
  storage["projection"] >> projection;
  EXPECT_DOUBLE_EQ(matrix.at<double>(0, 0), solved(5).camera.solution.refined.camera[0]);
  EXPECT_DOUBLE_EQ(distortion.at<double>(1), solved(5).camera.projection().distortion[1]);
  EXPECT_DOUBLE_EQ(projection.at<double>(2, 3), solved(5).camera.projection().matrix(2, 3));
}

TEST_F(AfterCalibration, mrcal_reads_its_model) {
  const std::string text = to_mrcal_model(solved(5).camera.projection());
  mrcal_cameramodel_t* model = mrcal_read_cameramodel_string(text.c_str(), static_cast<int>(text.size()));
  ASSERT_NE(model, nullptr) << text;
  EXPECT_EQ(model->lensmodel.type, MRCAL_LENSMODEL_OPENCV5);
  const CameraParameters& camera = solved(5).camera.solution.refined.camera;
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(model->intrinsics[i], camera[i], 1e-9 * std::max(1.0, std::abs(camera[i])));
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(model->rt_cam_ref[i], camera[kRotation + i], 1e-9);
  EXPECT_EQ(model->imagersize[0], 1280u);
  mrcal_free_cameramodel(&model);
}

TEST_F(AfterCalibration, next_pose_lowers_the_expected_error) {
  const auto next = suggest_next_pose(solved(5));
  ASSERT_TRUE(next);
  EXPECT_LT(next->camera_sd_px, solved(5).camera.deviation.mean_sd_px);
  EXPECT_LT(next->projector_sd_px, solved(5).projector->deviation.mean_sd_px);
  EXPECT_EQ(next->markers.size(), 30u);
}

TEST_F(AfterCalibration, report_draws_and_stands_alone) {
  write_report(solved(5), folder_ / "report.html");
  keep_page(folder_ / "report.html", "calibration");
  const std::string html = files::read_whole(folder_ / "report.html");
  EXPECT_NE(html.find("<svg"), std::string::npos);
  EXPECT_NE(html.find("next pose"), std::string::npos);
  EXPECT_EQ(html.find("src=\"http"), std::string::npos);
}

// Trials in which two corners and four markers are seen for a second; the camera is knocked before trial 3.
TEST_F(AfterCalibration, drift_names_the_trial_since_which_the_camera_stands_elsewhere) {
  const hardware_sim::SyntheticPoses truth = hardware_sim::make_synthetic_poses({});
  const CameraParameters camera = from_projection(truth.camera);
  PoseShift knock = PoseShift::Zero();
  knock[0] = 0.15 * M_PI / 180;
  std::mt19937 generator(5);
  std::normal_distribution<double> normal(0, 1);
  const auto trials = [&](int knocked_from) {
    std::vector<TrialSightings> all;
    for (int trial = 0; trial < 5; ++trial) {
      TrialSightings& one = all.emplace_back();
      one.trial = "waving-" + std::to_string(trial);
      for (int frame = 0; frame < 60; ++frame)
        for (int marker = 0; marker < 6; ++marker) {
          Sighting s;
          const Eigen::Vector3d point(0.08 * marker - 0.2 + 0.05 * std::sin(0.2 * frame), 0.02 * std::cos(0.3 * frame),
                                      0.9 + 0.06 * marker);
          s.pixel = pixel_of(camera, point, trial >= knocked_from ? &knock : nullptr) +
                    0.2 * Eigen::Vector2d(normal(generator), normal(generator));
          s.point = point + 0.0003 * Eigen::Vector3d(normal(generator), normal(generator), normal(generator));
          one.sightings.push_back(s);
        }
    }
    return all;
  };
  const Drift still = check_drift("camera", camera, trials(99));
  EXPECT_FALSE(still.since) << still.sentence;
  const Drift moved = check_drift("camera", camera, trials(3));
  ASSERT_TRUE(moved.since) << moved.sentence;
  EXPECT_EQ(*moved.since, "waving-3");
  EXPECT_NEAR(moved.trials[4].shift_px, 0.15 * M_PI / 180 * 1400, 0.8);
  EXPECT_FALSE(moved.trials[2].moved);
}

}  // namespace
}  // namespace selvedge::calib
