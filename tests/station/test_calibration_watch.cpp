// The camera's stand, judged from the held corners in the frames.
#include <algorithm>
#include <filesystem>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "station/calibration_watch.h"

namespace selvedge::station {
namespace {

// A bright trapezoid on black: corners at the given pixels, sides leaning outwards, one row of blur.
trial::GreyImage picture(const Eigen::Vector2d& left, const Eigen::Vector2d& right) {
  trial::GreyImage image = trial::GreyImage::Zero(240, 320);
  for (Eigen::Index y = 0; y < 240; ++y)
    for (Eigen::Index x = 0; x < 320; ++x) {
      const double down = static_cast<double>(y) - left.y();
      const double inside_left = static_cast<double>(x) - (left.x() - 0.1 * down),
                   inside_right = right.x() + 0.1 * down - static_cast<double>(x);
      const double cover =
          std::clamp(std::min({inside_left, inside_right, down, 200.0 - static_cast<double>(y)}) + 0.5, 0.0, 1.0);
      image(y, x) = static_cast<unsigned char>(2 + (x + y) % 2 + 180 * cover);
    }
  return image;
}

TEST(FindCorner, IsWhereTheSideEdgeEnds) {
  const Eigen::Vector2d left(90.3, 50.0), right(230.6, 50.0);
  const trial::GreyImage image = picture(left, right);
  const auto found_left = find_corner(image, left + Eigen::Vector2d(4, -6), true),
             found_right = find_corner(image, right + Eigen::Vector2d(-5, 3), false);
  ASSERT_TRUE(found_left && found_right);
  EXPECT_LT((*found_left - left).norm(), 0.8) << found_left->transpose();
  EXPECT_LT((*found_right - right).norm(), 0.8) << found_right->transpose();
}

TEST(FindCorner, NothingIsFoundFarFromWhereItShouldBe) {
  const trial::GreyImage image = picture({90, 50}, {230, 50});
  EXPECT_FALSE(find_corner(image, {20, 200}, true));
  EXPECT_FALSE(find_corner(trial::GreyImage::Constant(240, 320, 3), {90, 50}, true));
}

class RecordedCampaign : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path folder = SELVEDGE_SOURCE_DIR "/../shared/campaigns/striped-none";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "SKIPPED: " << folder << " is not here";
    campaign = trial::read_campaign(folder);
  }
  trial::Campaign campaign;
  WatchOptions options;
};

TEST_F(RecordedCampaign, ACameraThatStandsIsNotAccused) {
  const CalibrationWatch watch = watch_calibration(
      campaign, [](double, const std::string&) {}, options);
  EXPECT_FALSE(watch.camera.since) << watch.camera.sentence;
  EXPECT_TRUE(
      std::any_of(watch.camera.trials.begin(), watch.camera.trials.end(), [](const auto& t) { return t.judged; }));
}

TEST_F(RecordedCampaign, AKnockOfHalfADegreeIsNamedWithItsTrial) {
  ASSERT_GE(campaign.trials.size(), 3u);
  // A camera turned about its centre sees a point where it would have seen the point turned back before.
  const Eigen::AngleAxisd knock(0.5 * M_PI / 180, Eigen::Vector3d(0.7, 0.1, 0.7).normalized());
  for (size_t k = 2; k < campaign.trials.size(); ++k) {
    trial::Trial& t = campaign.trials[k];
    const Eigen::Vector3d centre = geometry::centre(*t.camera);
    for (Eigen::Matrix3Xd* corner : {&t.corners.left, &t.corners.right})
      *corner = (knock.toRotationMatrix() * (corner->colwise() - centre)).colwise() + centre;
  }
  const CalibrationWatch watch = watch_calibration(
      campaign, [](double, const std::string&) {}, options);
  ASSERT_TRUE(watch.camera.since) << watch.camera.sentence;
  EXPECT_EQ(*watch.camera.since, campaign.trials[2].name) << watch.camera.sentence;
}

}  // namespace
}  // namespace selvedge::station
