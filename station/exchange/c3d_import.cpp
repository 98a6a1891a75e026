#include "station/exchange/c3d_import.h"

#include <algorithm>
#include <map>

#include "files/bad_input.h"
#include "station/exchange/c3d_file.h"
#include "station/exchange/import_units.h"

namespace selvedge::station {

namespace {

using files::Section;

// A C3D file says its unit itself, unless the mapping does.
Units units_of_c3d(const C3dPoints& points, const files::TomlFile& mapping, const std::string& where) {
  Units units = read_units(mapping.section("units"));
  if (mapping.section("units").has("length_m")) return units;
  static const std::map<std::string, double> known = {{"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}};
  const auto unit = known.find(points.unit);
  if (unit == known.end())
    refuse(where, "found unit {}, expected mm, cm or m, or length_m in [units]", in_quotes(points.unit));
  units.length_m = unit->second;
  return units;
}

size_t place_of(const C3dPoints& points, const std::string& label, const std::string& where) {
  const auto found = std::find(points.labels.begin(), points.labels.end(), label);
  if (found != points.labels.end()) return static_cast<size_t>(found - points.labels.begin());
  std::string all;
  for (size_t i = 0; i < std::min<size_t>(points.labels.size(), 20); ++i)
    all += (i ? ", " : "") + in_quotes(points.labels[i]);
  refuse(where, "found no point {}, expected one of {}{}", in_quotes(label), all,
         points.labels.size() > 20 ? ", …" : "");
}

// Labels of a C3D file: marker k is the k-th of them. A hidden sample has no row.
trial::Markers read_c3d_markers(Section& keys, const C3dPoints& points, const Units& units) {
  const std::vector<std::string> labels = keys.texts("labels", std::nullopt);
  const std::vector<double> flat = keys.numbers("flat_m", std::nullopt, 2 * labels.size(), -10, 10, "m");
  if (labels.empty()) refuse(keys.where() + " labels", "found none, expected at least one");
  std::vector<const Eigen::Matrix3Xd*> seen;
  for (const std::string& label : labels)
    seen.push_back(&points.position[place_of(points, label, keys.where() + " labels")]);
  trial::Markers markers;
  std::vector<Eigen::Vector3d> positions;
  for (Eigen::Index frame = 0; frame < seen[0]->cols(); ++frame)
    for (size_t k = 0; k < labels.size(); ++k) {
      const Eigen::Vector3d x = seen[k]->col(frame);
      if (x.hasNaN()) continue;
      markers.time_s.push_back(static_cast<double>(frame) / points.rate_hz);
      markers.marker.push_back(static_cast<int>(k));
      markers.uv.emplace_back(flat[2 * k], flat[2 * k + 1]);
      positions.push_back(units.point(x.x(), x.y(), x.z()));
    }
  markers.position.resize(3, static_cast<Eigen::Index>(positions.size()));
  for (size_t i = 0; i < positions.size(); ++i) markers.position.col(static_cast<Eigen::Index>(i)) = positions[i];
  return markers;
}

trial::Corners read_c3d_corners(Section keys, const C3dPoints& points, const Units& units) {
  const std::string left = keys.text("left_label", std::nullopt), right = keys.text("right_label", std::nullopt);
  keys.finish();
  const auto path = [&](const std::string& label) -> Eigen::Matrix3Xd {
    return units.length_m * units.axes * points.position[place_of(points, label, keys.where())];
  };
  trial::Corners corners{{}, path(left), path(right)};
  for (Eigen::Index frame = 0; frame < corners.left.cols(); ++frame)
    corners.time_s.push_back(static_cast<double>(frame) / points.rate_hz);
  return corners;
}

}  // namespace

void read_c3d_parts(const files::TomlFile& mapping, const std::filesystem::path& base, trial::Trial& trial) {
  Section keys = mapping.section("markers");
  const std::filesystem::path file = base / keys.text("c3d", std::nullopt);
  const C3dPoints points = read_c3d(file);
  const Units units = units_of_c3d(points, mapping, file.string());
  trial.markers = read_c3d_markers(keys, points, units);
  trial.mocap_noise_m = keys.number("noise_m", 3e-4, 0, 0.1, "m");
  keys.finish();
  trial.corners = read_c3d_corners(mapping.section("corners"), points, units);
}

}  // namespace selvedge::station
