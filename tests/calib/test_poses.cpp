// poses/1 on disk: what goes in comes out, and what is damaged is refused by name.
#include <unistd.h>

#include <filesystem>

#include <gtest/gtest.h>

#include "calib/calibration.h"
#include "calib/poses.h"
#include "hardware_sim/synthetic_grid/synthetic_poses.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "tests/refusal.h"

namespace selvedge::calib {
namespace {

class PosesOnDisk : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("selvedge_poses_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name() + "_" + std::to_string(getpid()));
    hardware_sim::SyntheticOptions options;
    options.poses = 3;
    poses_ = hardware_sim::make_synthetic_poses(options).poses;
    poses_.rows[4].projector.reset();
    write_poses(poses_, folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string refusal() const {
    return refusal_of([&] { read_poses(folder_); });
  }
  void replace(const char* file, const std::string& from, const std::string& to) const {
    std::string bytes = files::read_whole(folder_ / file);
    const size_t at = bytes.find(from);
    ASSERT_NE(at, std::string::npos);
    files::write_whole(folder_ / file, bytes.replace(at, from.size(), to));
  }

  std::filesystem::path folder_;
  Poses poses_;
};

TEST_F(PosesOnDisk, come_back_bit_for_bit) {
  const Poses read = read_poses(folder_);
  ASSERT_EQ(read.rows.size(), poses_.rows.size());
  EXPECT_EQ(read.camera.width_px, poses_.camera.width_px);
  EXPECT_EQ(read.tracker_noise_m, poses_.tracker_noise_m);
  EXPECT_EQ(read.volume_high, poses_.volume_high);
  for (size_t i = 0; i < read.rows.size(); ++i) {
    EXPECT_EQ(read.rows[i].position, poses_.rows[i].position);
    EXPECT_EQ(read.rows[i].camera, poses_.rows[i].camera);
    EXPECT_EQ(read.rows[i].projector, poses_.rows[i].projector);
  }
  const Poses again = poses_from_json(to_json(read), "memory");
  EXPECT_EQ(again.rows.back().position, poses_.rows.back().position);
  EXPECT_FALSE(again.rows[4].projector.has_value());
}

TEST_F(PosesOnDisk, refuse_an_unknown_format) {
  replace("poses.json", "poses/1", "poses/9");
  EXPECT_NE(refusal().find("poses/1"), std::string::npos) << refusal();
}

TEST_F(PosesOnDisk, refuse_a_missing_key) {
  replace("poses.json", "tracker_noise_m", "tracker_noise");
  EXPECT_NE(refusal().find("tracker_noise_m"), std::string::npos) << refusal();
}

TEST_F(PosesOnDisk, refuse_a_missing_file) {
  std::filesystem::remove(folder_ / "correspondences.csv");
  EXPECT_NE(refusal().find("correspondences.csv"), std::string::npos) << refusal();
}

TEST_F(PosesOnDisk, refuse_a_missing_column) {
  replace("correspondences.csv", ",projector_v", ",projector_w");
  EXPECT_NE(refusal().find("projector_v"), std::string::npos) << refusal();
}

TEST_F(PosesOnDisk, refuse_a_number_that_is_not_finite) {
  replace("correspondences.csv", "\n0,1,", "\n0,1,nan,0,1,,,,\n0,77,");
  EXPECT_NE(refusal().find(":3"), std::string::npos) << refusal();
}

TEST_F(PosesOnDisk, refuse_half_a_pixel) {
  replace("correspondences.csv", "\n0,1,", "\n0,99,0,0,1,5,,,\n0,1,");
  EXPECT_NE(refusal().find("camera_u"), std::string::npos) << refusal();
}

TEST_F(PosesOnDisk, refuse_a_marker_twice) {
  replace("correspondences.csv", "\n0,1,", "\n0,0,");
  EXPECT_NE(refusal().find("second time"), std::string::npos) << refusal();
}

TEST_F(PosesOnDisk, refuse_a_file_that_is_cut_off) {
  const std::string bytes = files::read_whole(folder_ / "correspondences.csv");
  files::write_whole(folder_ / "correspondences.csv", bytes.substr(0, bytes.size() / 2 + 3));
  EXPECT_NE(refusal(), "");
}

}  // namespace
}  // namespace selvedge::calib
