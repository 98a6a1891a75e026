// The delay of the camera's clock from moving markers.
#include <cmath>

#include <gtest/gtest.h>

#include "hardware_sim/synthetic_grid/synthetic_motion.h"
#include "hardware_sim/synthetic_grid/synthetic_poses.h"

namespace selvedge::calib {
namespace {

class Delay : public ::testing::Test {
 protected:
  hardware_sim::SyntheticPoses truth_ = hardware_sim::make_synthetic_poses({});
  Eigen::Vector3d middle_ = (truth_.poses.volume_low + truth_.poses.volume_high) / 2;
  CameraParameters camera_ = from_projection(truth_.camera);
};

TEST_F(Delay, is_found_to_hundredths_of_a_millisecond) {
  for (const double delay_s : {-0.041, 0.0137}) {
    hardware_sim::MotionOptions motion;
    motion.offset_s = delay_s;
    const hardware_sim::SyntheticMotion made = hardware_sim::make_synthetic_motion(truth_.camera, middle_, motion);
    const TimeOffset offset = estimate_time_offset(camera_, made.tracks, made.sightings);
    EXPECT_TRUE(offset.known) << offset.why;
    EXPECT_NEAR(offset.offset_s, delay_s, 5e-5);
    EXPECT_LT(offset.sd_s, 5e-5);
    EXPECT_LT(offset.rms_px, 0.6);
    EXPECT_GT(offset.rms_without_px, 3 * offset.rms_px);
  }
}

TEST_F(Delay, bears_wrong_sightings_and_a_pose_that_is_off) {
  hardware_sim::MotionOptions motion;
  motion.outlier_share = 0.1;
  const hardware_sim::SyntheticMotion made = hardware_sim::make_synthetic_motion(truth_.camera, middle_, motion);
  PoseShift knock = PoseShift::Zero();
  knock[1] = 0.004;
  const TimeOffset offset = estimate_time_offset(shifted(camera_, knock), made.tracks, made.sightings);
  EXPECT_TRUE(offset.known) << offset.why;
  EXPECT_NEAR(offset.offset_s, motion.offset_s, 2e-4);
}

// 20 mm at 0.5 Hz, then hardly anything: the deviation says what is left, and only then is the delay refused.
TEST_F(Delay, of_gentle_motion_has_an_honest_deviation) {
  double squares = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    hardware_sim::MotionOptions motion;
    motion.seed = seed;
    motion.amplitude_m = 0.02;
    motion.frequency_hz = 0.5;
    const hardware_sim::SyntheticMotion made = hardware_sim::make_synthetic_motion(truth_.camera, middle_, motion);
    const TimeOffset offset = estimate_time_offset(camera_, made.tracks, made.sightings);
    ASSERT_TRUE(offset.known) << offset.why;
    EXPECT_LT(offset.sd_s, 0.003);
    squares += std::pow((offset.offset_s - motion.offset_s) / offset.sd_s, 2) / 8;
  }
  EXPECT_LT(std::sqrt(squares), 2);
}

TEST_F(Delay, is_refused_where_the_markers_hardly_move) {
  hardware_sim::MotionOptions motion;
  motion.amplitude_m = 0.001;
  motion.frequency_hz = 0.3;
  const hardware_sim::SyntheticMotion made = hardware_sim::make_synthetic_motion(truth_.camera, middle_, motion);
  const TimeOffset offset = estimate_time_offset(camera_, made.tracks, made.sightings);
  EXPECT_FALSE(offset.known) << offset.offset_s << " +- " << offset.sd_s;
  EXPECT_NE(offset.why.find("move too little"), std::string::npos) << offset.why;
}

}  // namespace
}  // namespace selvedge::calib
