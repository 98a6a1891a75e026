// A C3D file: tracked points of a motion capture, by label.
//
// Blocks of 512 bytes: a header, parameters in groups (POINT: what they are called, in which unit, how fast), then a
// frame after another of points as whole numbers times a scale, or as floats. Three kinds of numbers: of Intel's, DEC's
// and SGI's processors. Analogue channels are passed over. Source: The C3D File Format User Guide, Motion Lab Systems.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace selvedge::station {

struct C3dPoints {
  double rate_hz = 0;
  std::string unit;  // of positions, as the file says it: "mm", "m"; may be empty
  std::vector<std::string> labels;
  std::vector<Eigen::Matrix3Xd> position;  // one a label, a column a frame, in that unit; NaN where it was not seen
};

// Throws BadInput naming the path where it is no C3D file, or is cut short.
C3dPoints read_c3d(const std::filesystem::path& path);
// The same of bytes that were read already; `where` is for errors.
C3dPoints parse_c3d(std::string_view bytes, const std::string& where);

}  // namespace selvedge::station
