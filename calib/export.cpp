#include "calib/export.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <opencv2/core.hpp>

#include "calib/camera_model.h"
#include "files/whole_file.h"

namespace selvedge::calib {

void export_opencv_yaml(const geometry::Projection& projection, const std::filesystem::path& path) {
  const CameraParameters camera = from_projection(projection);
  const auto column = [&](int first) {
    return (cv::Mat_<double>(3, 1) << camera[first], camera[first + 1], camera[first + 2]);
  };
  cv::FileStorage storage(".yaml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
  storage << "image_width" << projection.width_px << "image_height" << projection.height_px;
  storage << "camera_matrix" << (cv::Mat_<double>(3, 3) << camera[0], 0, camera[2], 0, camera[1], camera[3], 0, 0, 1);
  storage << "distortion_coefficients" << cv::Mat(1, 5, CV_64F, const_cast<double*>(projection.distortion.data()));
  storage << "rvec" << cv::Mat(column(kRotation)) << "tvec" << cv::Mat(column(kTranslation));
  cv::Mat matrix(3, 4, CV_64F);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) matrix.at<double>(i, j) = projection.matrix(i, j);
  storage << "projection" << matrix;
  files::write_whole(path, storage.releaseAndGetString());
}

std::string to_mrcal_model(const geometry::Projection& projection) {
  const CameraParameters camera = from_projection(projection);
  return fmt::format(
      "{{\n"
      "    'lensmodel':  'LENSMODEL_OPENCV5',\n\n"
      "    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....\n"
      "    'intrinsics': [ {}, {} ],\n\n"
      "    # extrinsics are rt_fromref\n"
      "    'extrinsics': [ {}, {}, {}, {}, {}, {} ],\n\n"
      "    'imagersize': [ {}, {} ],\n"
      "}}\n",
      fmt::join(camera.data(), camera.data() + 4, ", "), fmt::join(projection.distortion, ", "), camera[kRotation],
      camera[kRotation + 1], camera[kRotation + 2], camera[kTranslation], camera[kTranslation + 1],
      camera[kTranslation + 2], projection.width_px, projection.height_px);
}

void export_mrcal_model(const geometry::Projection& projection, const std::filesystem::path& path) {
  files::write_whole(path, to_mrcal_model(projection));
}

}  // namespace selvedge::calib
