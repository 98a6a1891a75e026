#include "station/exchange/import_mapping.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "capture/trial/names.h"
#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/csv_table.h"
#include "files/toml_file.h"
#include "station/exchange/c3d_import.h"
#include "station/exchange/import_units.h"
#include "station/exchange/points_import.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
using files::Section;

std::vector<std::string> columns(Section& keys, const std::string& key, size_t count) {
  const auto names = keys.texts(key, std::nullopt);
  if (names.size() != count) refuse(keys.where() + " " + key, "found {} columns, expected {}", names.size(), count);
  return names;
}

trial::Markers read_markers(Section keys, const fs::path& base, const Units& units, trial::Trial& trial) {
  if (keys.has("frames")) return read_point_markers(keys, base, units, trial);
  const fs::path file = base / keys.text("file", std::nullopt);
  const std::string time = keys.text("time", std::nullopt), marker = keys.text("marker", std::nullopt);
  const auto position = columns(keys, "position", 3), flat = columns(keys, "flat", 2);
  trial.mocap_noise_m = keys.number("noise_m", 3e-4, 0, 0.1, "m");
  keys.finish();
  const files::CsvTable table =
      files::read_csv(file, {{time}, {marker}, {position[0]}, {position[1]}, {position[2]}, {flat[0]}, {flat[1]}});
  files::require_times_ascend(table, 0);
  trial::Markers markers;
  markers.position.resize(3, static_cast<Eigen::Index>(table.rows()));
  for (size_t row = 0; row < table.rows(); ++row) {
    markers.time_s.push_back(units.time_s * table(row, 0));
    markers.marker.push_back(files::whole_number(table, row, 1, marker.c_str()));
    markers.position.col(static_cast<Eigen::Index>(row)) = units.point(table(row, 2), table(row, 3), table(row, 4));
    markers.uv.emplace_back(units.length_m * table(row, 5), units.length_m * table(row, 6));
  }
  return markers;
}

// The two markers that sit at the held corners.
trial::Corners corners_of_markers(const trial::Markers& markers, int left, int right, const std::string& where) {
  std::map<double, std::array<std::optional<Eigen::Vector3d>, 2>> at;
  for (size_t i = 0; i < markers.marker.size(); ++i)
    for (const int side : {0, 1})
      if (markers.marker[i] == (side == 0 ? left : right))
        at[markers.time_s[i]][static_cast<size_t>(side)] = markers.position.col(static_cast<Eigen::Index>(i));
  trial::Corners corners;
  corners.left.resize(3, static_cast<Eigen::Index>(at.size()));
  corners.right.resize(3, static_cast<Eigen::Index>(at.size()));
  const Eigen::Vector3d hidden = Eigen::Vector3d::Constant(std::nan(""));
  Eigen::Index i = 0;
  for (const auto& [time_s, sides] : at) {
    corners.time_s.push_back(time_s);
    corners.left.col(i) = sides[0].value_or(hidden);
    corners.right.col(i++) = sides[1].value_or(hidden);
  }
  if (at.empty()) refuse(where, "no sample of marker {} or {}", left, right);
  return corners;
}

trial::Corners read_corners(Section keys, const fs::path& base, const Units& units, const trial::Trial& trial) {
  if (keys.has("left_marker")) {
    const int left = static_cast<int>(keys.integer("left_marker", std::nullopt, 0, 1 << 30)),
              right = static_cast<int>(keys.integer("right_marker", std::nullopt, 0, 1 << 30));
    keys.finish();
    if (!trial.markers) refuse(keys.where() + " left_marker", "there are no markers");
    return corners_of_markers(*trial.markers, left, right, keys.where());
  }
  const fs::path file = base / keys.text("file", std::nullopt);
  const std::string time = keys.text("time", std::nullopt);
  const auto left = columns(keys, "left", 3), right = columns(keys, "right", 3);
  keys.finish();
  const files::CsvTable table = files::read_csv(file, {{time},
                                                       {left[0], true},
                                                       {left[1], true},
                                                       {left[2], true},
                                                       {right[0], true},
                                                       {right[1], true},
                                                       {right[2], true}});
  files::require_times_ascend(table, 0);
  trial::Corners corners;
  corners.left.resize(3, static_cast<Eigen::Index>(table.rows()));
  corners.right.resize(3, static_cast<Eigen::Index>(table.rows()));
  for (size_t row = 0; row < table.rows(); ++row) {
    corners.time_s.push_back(units.time_s * table(row, 0));
    corners.left.col(static_cast<Eigen::Index>(row)) = units.point(table(row, 1), table(row, 2), table(row, 3));
    corners.right.col(static_cast<Eigen::Index>(row)) = units.point(table(row, 4), table(row, 5), table(row, 6));
  }
  return corners;
}

geometry::Projection read_optics(Section keys) {
  geometry::Projection p;
  p.width_px = static_cast<int>(keys.integer("width_px", std::nullopt, 1, 16384, "px"));
  p.height_px = static_cast<int>(keys.integer("height_px", std::nullopt, 1, 16384, "px"));
  const auto matrix = keys.numbers("projection", std::nullopt, 12, -1e12, 1e12, "px");
  const auto distortion = keys.numbers("distortion", std::vector<double>(5, 0.0), 5, -100, 100, "1");
  keys.finish();
  for (int i = 0; i < 12; ++i) p.matrix(i / 4, i % 4) = matrix[static_cast<size_t>(i)];
  std::copy(distortion.begin(), distortion.end(), p.distortion.begin());
  return p;
}

// Empty where it is no picture that can be read. OpenCV throws over sizes that it does not take.
cv::Mat decoded(const fs::path& picture) {
  try {
    return cv::imread(picture.string(), cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) { return {}; }
}

std::vector<trial::GreyImage> read_images(Section keys, const fs::path& base, trial::Trial& trial) {
  const fs::path folder = base / keys.text("folder", std::nullopt);
  trial.frame_rate_hz = keys.number("rate_hz", std::nullopt, 0.1, 1e5, "Hz");
  const double start_s = keys.number("start_s", 0, -1e6, 1e6, "s");
  keys.finish();
  if (!fs::is_directory(folder)) refuse(keys.where() + " folder", "{} is no folder", folder.string());
  if (!trial.camera) refuse(keys.where(), "pictures need a section [camera]");
  const std::vector<fs::path> pictures = files_in_order(folder);
  if (pictures.empty()) refuse(keys.where() + " folder", "{} is empty", folder.string());
  std::vector<trial::GreyImage> images;
  trial.frames.emplace();
  for (const fs::path& picture : pictures) {
    const cv::Mat grey = decoded(picture);
    if (grey.empty()) refuse(picture.string(), "is no picture that can be read");
    if (grey.cols != trial.camera->width_px || grey.rows != trial.camera->height_px)
      refuse(picture.string(), "has {}×{} px, [camera] says {}×{}", grey.cols, grey.rows, trial.camera->width_px,
             trial.camera->height_px);
    const int number = static_cast<int>(images.size());
    trial.frames->number.push_back(number);
    trial.frames->time_s.push_back(start_s + number / trial.frame_rate_hz);
    images.emplace_back(Eigen::Map<const trial::GreyImage>(grey.data, grey.rows, grey.cols));
  }
  return images;
}

void read_pattern(Section keys, trial::Trial& trial) {
  trial::StripePattern pattern;
  pattern.orientation = keys.choice("orientation", "horizontal", {"horizontal", "vertical"});
  pattern.period_px = keys.number("period_px", std::nullopt, 2, 1e4, "px");
  pattern.duty = keys.number("duty", 0.5, 0.01, 0.99, "(share)");
  pattern.first_bright_row_px = keys.number("first_bright_row_px", 0, -1e5, 1e5, "px");
  keys.finish();
  trial.pattern = pattern;
}

double rate_of(const std::vector<double>& time_s) {
  return time_s.size() > 1 && time_s.back() > time_s.front()
             ? static_cast<double>(time_s.size() - 1) / (time_s.back() - time_s.front())
             : 1;
}

trial::Trial read_about(const files::TomlFile& file) {
  trial::Trial trial;
  Section about = file.section("trial");
  trial.name = about.text("name", std::nullopt);
  if (!trial::is_plain_name(trial.name))
    refuse(about.where() + " name", "found {}, expected small letters, digits, - and _", in_quotes(trial.name));
  trial.experiment = trial::experiment_named(about.choice("kind", std::nullopt, {"static", "waving", "robot"})).value();
  trial.starts_at_rest = about.flag("starts_at_rest", true);
  const auto g = about.numbers("gravity_m_s2", std::vector<double>{0, 0, -9.81}, 3, -100, 100, "m/s²");
  trial.gravity_m_s2 = Eigen::Vector3d(g[0], g[1], g[2]);
  about.finish();
  Section fabric = file.section("fabric");
  trial.fabric.name = fabric.text("name", "");
  trial.fabric.width_m = fabric.number("width_m", std::nullopt, 0.01, 10, "m");
  trial.fabric.height_m = fabric.number("height_m", std::nullopt, 0.01, 10, "m");
  trial.fabric.mass_kg = fabric.number("mass_kg", std::nullopt, 1e-5, 10, "kg");
  trial.fabric.mass_known = fabric.flag("mass_known", true);
  fabric.finish();
  return trial;
}

}  // namespace

Recording read_recording(const fs::path& mapping) {
  const fs::path base = mapping.parent_path();
  const files::TomlFile file = files::TomlFile::load(mapping, {"trial", "fabric", "corners", "markers", "surface",
                                                               "images", "camera", "projector", "pattern", "units"});
  Recording recording{read_about(file), {}};
  trial::Trial& trial = recording.trial;
  const Units units = read_units(file.section("units"));
  if (file.has("camera")) trial.camera = read_optics(file.section("camera"));
  if (file.has("projector")) trial.projector = read_optics(file.section("projector"));
  if (file.has("pattern")) read_pattern(file.section("pattern"), trial);
  const bool of_c3d = file.has("markers") && file.section("markers").has("c3d");
  if (of_c3d) read_c3d_parts(file, base, trial);
  else if (file.has("markers")) trial.markers = read_markers(file.section("markers"), base, units, trial);
  if (file.has("images")) recording.images = read_images(file.section("images"), base, trial);
  if (file.has("surface")) trial.surface = read_surface(file.section("surface"), base, units);
  if (!trial.markers && !trial.surface && recording.images.empty())
    refuse(mapping.string(), "found none of [markers], [surface] and [images], expected one of them");
  if (!of_c3d) trial.corners = read_corners(file.section("corners"), base, units, trial);
  trial.mocap_rate_hz = rate_of(trial.corners.time_s);
  return recording;
}

fs::path import_recording(const fs::path& mapping, const fs::path& folder) {
  const auto [trial, images] = read_recording(mapping);
  const fs::path out = folder / trial.name;
  if (fs::exists(out)) refuse("--out", "{} is there already", out.string());
  const fs::path unfinished = folder / ("." + trial.name + ".part");
  fs::remove_all(unfinished);
  try {
    trial::write_trial(trial, unfinished, images);
    trial::read_trial(unfinished);  // what cannot be read back is refused here
  } catch (...) {
    fs::remove_all(unfinished);
    throw;
  }
  fs::rename(unfinished, out);
  return out;
}

}  // namespace selvedge::station
