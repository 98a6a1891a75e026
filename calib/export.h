// The calibration in the files of others: OpenCV's YAML, and mrcal's camera model.
//
// OpenCV: camera_matrix, distortion_coefficients (k1 k2 p1 p2 k3), rvec, tvec (camera from world), projection.
// mrcal: LENSMODEL_OPENCV5 with fx fy cx cy k1 k2 p1 p2 k3; extrinsics are rt_fromref, a rotation vector and a
// translation, camera from world. Pixels of both have (0,0) at the centre of a pixel; m.
// Source: OpenCV 4.6 FileStorage; https://mrcal.secretsauce.net/cameramodels.html
#pragma once

#include <filesystem>
#include <string>

#include "geometry/projection.h"

namespace selvedge::calib {

// Whole file or nothing. Throws std::invalid_argument where the projection has no finite centre.
void export_opencv_yaml(const geometry::Projection& projection, const std::filesystem::path& path);
void export_mrcal_model(const geometry::Projection& projection, const std::filesystem::path& path);

std::string to_mrcal_model(const geometry::Projection& projection);

}  // namespace selvedge::calib
