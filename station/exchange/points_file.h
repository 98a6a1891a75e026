// Points in space as scanners, simulators and NumPy write them: PLY, PCD and NPY files.
//
// PLY: the element `vertex`, ascii or binary of either byte order; other elements are passed over. PCD: ascii, binary
// and binary_compressed; what its VIEWPOINT says is passed over. NPY: points × 3, or frames × points × 3, or frames ×
// rows × columns × 3. Numbers of 1 to 8 bytes, whole ones and floats. Sources: G. Turk, The PLY Polygon File Format;
// pointclouds.org, The PCD file format; numpy.org, numpy.lib.format.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace selvedge::station {

// One frame, but for an NPY of several. In the file's unit; NaN where a point was not seen. Throws BadInput naming the
// path where it is no such file, or is cut short.
std::vector<Eigen::Matrix3Xd> read_points(const std::filesystem::path& path);
// The same of bytes that were read already. kind: ".ply", ".pcd" or ".npy"; `where` is for errors.
std::vector<Eigen::Matrix3Xd> parse_points(std::string_view bytes, const std::string& kind, const std::string& where);
std::vector<Eigen::Matrix3Xd> parse_ply(std::string_view bytes, const std::string& where);
std::vector<Eigen::Matrix3Xd> parse_pcd(std::string_view bytes, const std::string& where);
std::vector<Eigen::Matrix3Xd> parse_npy(std::string_view bytes, const std::string& where);

}  // namespace selvedge::station
