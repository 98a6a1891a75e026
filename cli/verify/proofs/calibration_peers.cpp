#include "cli/verify/proofs/calibration_peers.h"

#include <algorithm>

#include <opencv2/calib3d.hpp>

extern "C" {
#include <mrcal/mrcal.h>
}

namespace selvedge::cli {

using calib::CameraParameters;
using calib::ImageSize;
using calib::Sighting;

geometry::Projection solve_with_opencv(const std::vector<Sighting>& sightings, const ImageSize& size,
                                       const CameraParameters& start) {
  std::vector<std::vector<cv::Point3f>> points(1);
  std::vector<std::vector<cv::Point2f>> pixels(1);
  for (const Sighting& s : sightings) {
    points[0].emplace_back(s.point.x(), s.point.y(), s.point.z());
    pixels[0].emplace_back(s.pixel.x(), s.pixel.y());
  }
  // OpenCV refuses a principal point outside the image, where wrong labels may put that of the linear start.
  const double cx = std::clamp(start[2], 1.0, size.width_px - 2.0),
               cy = std::clamp(start[3], 1.0, size.height_px - 2.0);
  cv::Mat matrix = (cv::Mat_<double>(3, 3) << start[0], 0, cx, 0, start[1], cy, 0, 0, 1);
  cv::Mat distortion = cv::Mat::zeros(1, 5, CV_64F);
  std::vector<cv::Mat> rotations, translations;
  cv::calibrateCamera(points, pixels, cv::Size(size.width_px, size.height_px), matrix, distortion, rotations,
                      translations, cv::CALIB_USE_INTRINSIC_GUESS | cv::CALIB_FIX_K3,
                      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-12));
  CameraParameters camera = CameraParameters::Zero();
  camera.head<4>() << matrix.at<double>(0, 0), matrix.at<double>(1, 1), matrix.at<double>(0, 2),
      matrix.at<double>(1, 2);
  for (int i = 0; i < 4; ++i) camera[calib::kDistortion + i] = distortion.at<double>(i);
  for (int i = 0; i < 3; ++i) {
    camera[calib::kRotation + i] = rotations[0].at<double>(i);
    camera[calib::kTranslation + i] = translations[0].at<double>(i);
  }
  return calib::to_projection(camera, size);
}

geometry::Projection solve_with_mrcal(const std::vector<Sighting>& sightings, const ImageSize& size,
                                      const CameraParameters& start) {
  mrcal_lensmodel_t lens{};
  mrcal_lensmodel_from_name(&lens, "LENSMODEL_OPENCV4");
  double intrinsics[8] = {start[0], start[1], start[2], start[3], 0, 0, 0, 0};
  mrcal_pose_t pose{};
  for (int i = 0; i < 3; ++i) {
    pose.r.xyz[i] = start[calib::kRotation + i];
    pose.t.xyz[i] = start[calib::kTranslation + i];
  }
  std::vector<mrcal_point3_t> points(sightings.size());
  std::vector<mrcal_observation_point_t> observations(sightings.size());
  for (size_t i = 0; i < sightings.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) points[i].xyz[axis] = sightings[i].point[axis];
    observations[i].icam = {0, 0};
    observations[i].i_point = static_cast<int>(i);
    observations[i].px.xyz[0] = sightings[i].pixel.x();
    observations[i].px.xyz[1] = sightings[i].pixel.y();
    observations[i].px.xyz[2] = 1;
  }
  mrcal_problem_selections_t selections{};
  selections.do_optimize_intrinsics_core = true;
  selections.do_optimize_intrinsics_distortions = true;
  selections.do_optimize_extrinsics = true;
  selections.do_apply_regularization = true;
  const mrcal_problem_constants_t constants{.point_min_range = 0.1, .point_max_range = 100};
  const int image_size[2] = {size.width_px, size.height_px};
  const int count = static_cast<int>(sightings.size());
  mrcal_optimize(nullptr, 0, nullptr, 0, intrinsics, &pose, nullptr, points.data(), nullptr, 1, 1, 0, count, count,
                 nullptr, observations.data(), 0, count, nullptr, &lens, image_size, selections, &constants, 0, 0, 0,
                 false, false);
  CameraParameters camera = CameraParameters::Zero();
  for (int i = 0; i < 8; ++i) camera[i] = intrinsics[i];
  for (int i = 0; i < 3; ++i) {
    camera[calib::kRotation + i] = pose.r.xyz[i];
    camera[calib::kTranslation + i] = pose.t.xyz[i];
  }
  return calib::to_projection(camera, size);
}

}  // namespace selvedge::cli
