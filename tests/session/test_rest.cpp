#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "capture/session/rest.h"

namespace selvedge::session {
namespace {

// Two corners and a striped picture, both shifted by `shift_m`, with noise as of a real tracker and camera.
class Scene {
 public:
  // Feeds `seconds` at 100 Hz and 25 Hz; shift(t) in m.
  template <class Shift>
  void feed(RestDetector& detector, double seconds, Shift shift) {
    for (const double end_s = time_s_ + seconds; time_s_ < end_s; time_s_ += 0.01, ++step_) {
      detector.add(corners(shift(time_s_)));
      if (step_ % 4 == 0) detector.add(picture(shift(time_s_)));
    }
  }

 private:
  selvedge_rig::corner_sample_t corners(double shift_m) {
    std::normal_distribution<double> noise(0, 2e-4);
    selvedge_rig::corner_sample_t sample{};
    sample.utime = static_cast<int64_t>(1e6 * time_s_);
    sample.count = 2;
    sample.name = {"left", "right"};
    sample.occluded = {false, false};
    sample.x_m = {noise(random_), 0.3 + shift_m + noise(random_)};
    sample.y_m = {noise(random_), noise(random_)};
    sample.z_m = {noise(random_), noise(random_)};
    return sample;
  }
  Frame picture(double shift_m) {
    std::normal_distribution<double> noise(0, 1.5);
    Frame frame{step_, time_s_, 0.002, 1e-4, std::vector<uint8_t>(160 * 120)};
    for (int row = 0; row < 120; ++row)
      for (int column = 0; column < 160; ++column) {
        const double stripe = 120 + 80 * std::tanh(3 * std::sin(0.5 * (row + 1000 * shift_m)));
        frame.pixels[static_cast<size_t>(160 * row + column)] = static_cast<uint8_t>(stripe + noise(random_));
      }
    return frame;
  }
  double time_s_ = 100;
  int64_t step_ = 0;
  std::mt19937 random_{1};
};

TEST(RestDetector, FindsNoiseAtRest) {
  RestDetector detector;
  Scene scene;
  scene.feed(detector, 0.9, [](double) { return 0.0; });
  EXPECT_FALSE(detector.at_rest());  // not for long enough yet
  scene.feed(detector, 1.5, [](double) { return 0.0; });
  EXPECT_TRUE(detector.at_rest());
}

TEST(RestDetector, SeesASlowSwingAndForgetsItLater) {
  RestDetector detector;
  Scene scene;
  scene.feed(detector, 4, [](double t) { return 0.003 * std::sin(2 * M_PI * 0.8 * t); });
  EXPECT_FALSE(detector.at_rest());
  scene.feed(detector, 3, [](double) { return 0.0; });
  EXPECT_TRUE(detector.at_rest());
}

TEST(RestDetector, DoesNotTakeHiddenCornersForRest) {
  RestDetector detector;
  selvedge_rig::corner_sample_t sample{};
  sample.count = 2;
  sample.name = {"left", "right"};
  sample.occluded = {true, false};
  sample.x_m = sample.y_m = sample.z_m = {NAN, 0};
  for (int i = 0; i < 300; ++i) {
    sample.utime = 10000 * i;
    detector.add(sample);
    detector.add(Frame{i, 0.01 * i, 0.002, 1e-4, std::vector<uint8_t>(1000, 100)});
  }
  EXPECT_FALSE(detector.at_rest());
}

}  // namespace
}  // namespace selvedge::session
