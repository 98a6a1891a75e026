// From made-up images to correspondences: centres, labels without a known camera, projector pixels, and what
// must be named.
#include <unistd.h>

#include <filesystem>

#include <gtest/gtest.h>

#include "calib/image_folder.h"
#include "calib/read_images.h"
#include "hardware_sim/synthetic_grid/synthetic_recording.h"
#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::calib {
namespace {

struct Recording {
  MarkerGrid grid;
  hardware_sim::SyntheticPoses truth;
  std::vector<PoseImages> images;
};

// Pattern images for the first `decoded` poses alone: they take longest to make.
Recording record(const hardware_sim::BoardLook& look, int poses, size_t decoded) {
  Recording recording;
  hardware_sim::SyntheticOptions made;
  made.poses = poses;
  made.seed = 21;
  recording.truth = hardware_sim::make_synthetic_poses(made);
  recording.images = hardware_sim::record_images(recording.truth, recording.grid, look, decoded);
  return recording;
}

Eigen::Vector3d true_point(const Recording& recording, int pose, int marker) {
  return recording.truth.world_from_grid[pose] * marker_positions(recording.grid)[marker];
}

const Recording& plain() {
  static const Recording recording = record({}, 5, 1);
  return recording;
}

double largest_camera_error(const Recording& recording, const ImageReading& reading) {
  double largest = 0;
  for (const Correspondence& row : reading.poses.rows)
    if (row.camera)
      largest = std::max(largest, (*row.camera - geometry::project(recording.truth.camera,
                                                                   true_point(recording, row.pose, row.marker)))
                                      .norm());
  return largest;
}

TEST(images, give_centres_labels_and_projector_pixels) {
  const ImageReading reading = read_images(plain().images, plain().truth.poses);
  EXPECT_EQ(reading.matched_share, 1.0);
  EXPECT_TRUE(reading.unread.empty());
  EXPECT_LT(largest_camera_error(plain(), reading), 0.1);
  double sum = 0;
  int count = 0;
  for (const Correspondence& row : reading.poses.rows)
    if (row.projector) {
      sum += (*row.projector - geometry::project(plain().truth.projector, true_point(plain(), row.pose, row.marker)))
                 .squaredNorm() /
             2;
      ++count;
    }
  EXPECT_EQ(count, 30);
  EXPECT_LT(std::sqrt(sum / count), 0.1);
  EXPECT_NEAR(reading.gamma, 1, 0.05);
}

TEST(images, hidden_merged_and_false_blobs_are_told_apart) {
  Recording recording = plain();
  const auto paint = [&](int pose, const Eigen::Vector2d& at, double radius, unsigned char grey) {
    GreyImage& image = recording.images[pose].marker_image;
    for (int row = 0; row < image.rows(); ++row)
      for (int column = 0; column < image.cols(); ++column)
        if ((Eigen::Vector2d(column, row) - at).norm() < radius) image(row, column) = grey;
  };
  const auto pixel = [&](int pose, int marker) {
    return geometry::project(recording.truth.camera, true_point(recording, pose, marker));
  };
  paint(0, pixel(0, 7), 12, 12);                                                           // hidden
  paint(1, pixel(1, 3) + Eigen::Vector2d(9, 0), 5, 200);                                   // merged with a reflection
  for (int i = 0; i < 6; ++i) paint(2, Eigen::Vector2d(60 + 40 * i, 70 + 3 * i), 5, 210);  // false
  // A marker that the tracker lost has a blob and no position.
  recording.images[3].markers.erase(recording.images[3].markers.begin() + 11);
  for (PoseImages& pose : recording.images) pose.sequence.clear();

  const ImageReading reading = read_images(recording.images, recording.truth.poses);
  EXPECT_LT(largest_camera_error(recording, reading), 0.15);
  const auto row_of = [&](int pose, int marker) {
    for (const Correspondence& row : reading.poses.rows)
      if (row.pose == pose && row.marker == marker) return row;
    return Correspondence{-1, -1, {}, {}, {}};
  };
  EXPECT_FALSE(row_of(0, 7).camera);
  EXPECT_FALSE(row_of(1, 3).camera);
  EXPECT_EQ(row_of(3, 11).pose, -1);
  ASSERT_EQ(reading.unread.size(), 2u);
  EXPECT_NE(reading.unread[0].why.find("hidden"), std::string::npos);
  EXPECT_NE(reading.unread[1].why.find("merged"), std::string::npos);
  EXPECT_GE(reading.matched_share, 0.98);
}

TEST(images, a_camera_knocked_between_poses_keeps_its_labels_and_is_named) {
  hardware_sim::SyntheticOptions made;
  made.poses = 8;
  hardware_sim::SyntheticPoses truth = hardware_sim::make_synthetic_poses(made);
  const MarkerGrid grid;
  std::vector<PoseImages> images = hardware_sim::record_images(truth, grid, {}, 0);
  truth.camera = hardware_sim::turned(truth.camera, {0.2, 0.5, 0.3});
  const std::vector<PoseImages> before = hardware_sim::record_images(truth, grid, {}, 0);
  for (size_t pose = 0; pose < 4; ++pose) images[pose].marker_image = before[pose].marker_image;
  const Calibration calibration = calibrate_images(images, truth.poses);
  EXPECT_TRUE(calibration.rejected.empty());
  ASSERT_EQ(calibration.camera.solution.events.size(), 1u) << calibration.advice;
  EXPECT_NE(calibration.advice.find("camera moved between poses 3 and 4"), std::string::npos) << calibration.advice;
}

TEST(images, gamma_is_measured_and_taken_out) {
  hardware_sim::BoardLook look;
  look.gamma = 2.2;
  Recording recording = record(look, 4, 1);
  const auto error = [&](const ImageReading& reading) {
    double sum = 0;
    int count = 0;
    for (const Correspondence& row : reading.poses.rows)
      if (row.projector) {
        sum +=
            (*row.projector - geometry::project(recording.truth.projector, true_point(recording, row.pose, row.marker)))
                .squaredNorm();
        ++count;
      }
    EXPECT_GT(count, 25);
    return std::sqrt(sum / (2 * count));
  };
  const ImageReading levels = read_images(recording.images, recording.truth.poses);
  EXPECT_NEAR(levels.gamma, 2.2, 0.05);
  EXPECT_LT(error(levels), 0.1);
  // Without the plain levels the second harmonic of the phases must tell.
  std::erase_if(recording.images[0].sequence, [](const PatternImage& image) {
    return image.step.kind == PatternStep::Kind::solid && image.step.level < 1;
  });
  const ImageReading harmonics = read_images(recording.images, recording.truth.poses);
  EXPECT_NEAR(harmonics.gamma, 2.2, 0.3);
  EXPECT_LT(error(harmonics), 0.15);
}

TEST(images, a_projector_out_of_focus_is_named_and_survived) {
  hardware_sim::BoardLook look;
  look.projector_blur_px = 5;
  const Recording recording = record(look, 4, 1);
  const ImageReading reading = read_images(recording.images, recording.truth.poses);
  EXPECT_NEAR(reading.projector_blur_px, 5, 1);
  ASSERT_FALSE(reading.remarks.empty());
  EXPECT_NE(reading.remarks[0].find("out of focus"), std::string::npos);
  int decoded = 0;
  for (const Correspondence& row : reading.poses.rows) decoded += row.projector.has_value();
  EXPECT_GE(decoded, 28);
}

TEST(images, clipped_highlights_are_named_marker_by_marker) {
  hardware_sim::BoardLook look;
  look.exposure = 1.9;
  const Recording recording = record(look, 4, 1);
  const ImageReading reading = read_images(recording.images, recording.truth.poses);
  int clipped = 0;
  for (const RejectedSighting& r : reading.unread) clipped += r.why.find("clipped") != std::string::npos;
  EXPECT_GT(clipped, 0);
  bool remarked = false;
  for (const std::string& remark : reading.remarks) remarked |= remark.find("Clipped") != std::string::npos;
  EXPECT_TRUE(remarked);
}

TEST(images, an_incomplete_sequence_is_refused) {
  Recording recording = plain();
  std::erase_if(recording.images[0].sequence, [](const PatternImage& image) {
    return image.step.kind == PatternStep::Kind::gray_code && image.step.bit == 6;
  });
  EXPECT_THROW(read_images(recording.images, recording.truth.poses), BadInput);
}

TEST(images, a_folder_of_images_comes_back_and_damage_is_refused) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("selvedge_images_" + std::to_string(getpid()));
  ImageFolder written{plain().truth.poses, plain().images};
  written.header.rows.clear();
  const auto sequence = written.poses[0].sequence;
  for (PoseImages& pose : written.poses) pose.sequence.assign(sequence.begin(), sequence.begin() + 2);
  write_image_folder(written, folder);
  const ImageFolder back = read_image_folder(folder);
  ASSERT_EQ(back.poses.size(), written.poses.size());
  EXPECT_EQ(back.poses[2].marker_image, written.poses[2].marker_image);
  EXPECT_EQ(back.poses[1].sequence[1].step, written.poses[1].sequence[1].step);
  EXPECT_EQ(back.poses[4].markers.size(), written.poses[4].markers.size());
  files::write_whole(folder / "pose-1" / "markers.png", "no picture");
  EXPECT_THROW(read_image_folder(folder), BadInput);
  std::filesystem::remove(folder / "pose-1" / "markers.png");
  EXPECT_THROW(read_image_folder(folder), BadInput);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace selvedge::calib
