#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "capture/trial/checked_trial.h"
#include "capture/trial/grey_png.h"
#include "capture/trial/material_test_files.h"
#include "capture/trial/trial.h"
#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/csv_table.h"
#include "files/json_reader.h"
#include "files/whole_file.h"

namespace selvedge::trial {

namespace fs = std::filesystem;
using files::CsvTable;
using files::JsonReader;

namespace {

const std::vector<std::string> experiment_texts = {"static", "waving", "robot", "cantilever", "cusick", "tensile"};
const std::vector<std::string> held_texts = {"corners", "top_edge", "top_edge_clamped"};
const std::vector<std::string> state_texts = {"complete", "cut", "recording"};

Eigen::Vector3d to_vector(const std::vector<double>& numbers) { return {numbers[0], numbers[1], numbers[2]}; }

void require_rank_three(const geometry::Projection& projection, const std::string& where) {
  const Eigen::Vector3d values = geometry::singular_values(projection.matrix);
  if (!(values(2) > 1e-9 * values(0)))
    refuse(where,
           "found a matrix of rank {}, expected rank 3 (singular values {:.3g}, {:.3g}, {:.3g} with rows of "
           "length 1)",
           static_cast<int>((values.array() > 1e-9 * values(0)).count()), values(0), values(1), values(2));
  const Eigen::Matrix3d left = projection.matrix.leftCols<3>();
  if (std::abs(left.determinant()) < 1e-12 * std::pow(left.norm(), 3))
    refuse(where, "found a singular left 3x3 block (a centre at infinity), expected a pinhole projection");
}

geometry::Projection read_projection(const JsonReader& json) {
  geometry::Projection projection;
  projection.width_px = json.positive_whole("width_px");
  projection.height_px = json.positive_whole("height_px");
  const nlohmann::json& rows = json.value("projection");
  const std::string where = json.where("projection");
  if (!rows.is_array() || rows.size() != 3) refuse(where, "found {}, expected 3 rows of 4 numbers", files::shown(rows));
  for (int i = 0; i < 3; ++i) {
    const std::vector<double> row = files::finite_numbers(rows[i], 4, where + fmt::format("[{}]", i));
    projection.matrix.row(i) = Eigen::Map<const Eigen::RowVector4d>(row.data());
  }
  if (json.has("distortion")) {
    const std::vector<double> values = json.numbers("distortion", 5);
    std::copy(values.begin(), values.end(), projection.distortion.begin());
  }
  require_rank_three(projection, where);
  return projection;
}

StripePattern read_pattern(const JsonReader& json) {
  StripePattern pattern;
  json.choice("kind", {"stripes"});
  if (json.has("orientation")) json.choice("orientation", {"horizontal"});
  pattern.period_px = json.positive("period_px");
  pattern.duty = json.number_or("duty", pattern.duty);
  if (!(pattern.duty > 0 && pattern.duty < 1))
    refuse(json.where("duty"), "found {}, expected a share between 0 and 1", pattern.duty);
  pattern.first_bright_row_px = json.number_or("first_bright_row_px", 0);
  return pattern;
}

// What can be a fabric in a rig: no fit runs on what lies far beyond.
constexpr double kSmallest_m = 1e-3, kLargest_m = 100, kLightest_kg = 1e-6, kHeaviest_kg = 1e3;

double between(const JsonReader& json, const std::string& key, double low, double high, const char* unit) {
  const double value = json.positive(key);
  if (value < low || value > high)
    refuse(json.where(key), "found {} {}, expected {} to {} {}", value, unit, low, high, unit);
  return value;
}

Fabric read_fabric(const JsonReader& json) {
  Fabric fabric;
  if (json.has("name")) fabric.name = json.text("name");
  fabric.width_m = between(json, "width_m", kSmallest_m, kLargest_m, "m");
  fabric.height_m = between(json, "height_m", kSmallest_m, kLargest_m, "m");
  fabric.mass_kg = between(json, "mass_kg", kLightest_kg, kHeaviest_kg, "kg");
  fabric.mass_known = json.truth_or("mass_known", true);
  return fabric;
}

void read_holding(const JsonReader& json, Trial& trial) {
  if (json.has("held")) trial.held = static_cast<Held>(json.choice("held", held_texts));
  if (trial.held != Held::top_edge_clamped && !json.has("clamp_direction")) return;
  trial.clamp_direction = to_vector(json.numbers("clamp_direction", 3));
  if (trial.clamp_direction.norm() == 0)
    refuse(json.where("clamp_direction"), "found a direction of length 0, expected one that is longer");
}

void read_rates(const JsonReader& json, Trial& trial) {
  if (json.has("frames")) {
    const JsonReader frames = json.child("frames");
    trial.frame_rate_hz = frames.not_negative_or("rate_hz", 0);
    trial.exposure_s = frames.not_negative_or("exposure_s", 0);
  }
  if (json.has("mocap")) {
    const JsonReader mocap = json.child("mocap");
    trial.mocap_rate_hz = mocap.not_negative_or("rate_hz", 0);
    if (mocap.has("noise_m")) trial.mocap_noise_m = mocap.not_negative_or("noise_m", 0);
    if (mocap.has("noise_grey_levels")) trial.noise_grey_levels = mocap.not_negative_or("noise_grey_levels", 0);
  }
  if (json.has("noise_grey_levels")) trial.noise_grey_levels = json.not_negative_or("noise_grey_levels", 0);
}

void read_trial_json(const JsonReader& json, Trial& trial) {
  json.choice("format", {"trial/1"});
  trial.experiment = static_cast<Experiment>(json.choice("experiment", experiment_texts));
  if (json.has("state")) trial.state = static_cast<State>(json.choice("state", state_texts));
  read_holding(json, trial);
  trial.fabric = read_fabric(json.child("fabric"));
  if (is_material_test(trial.experiment)) read_material_test(json, trial);
  trial.starts_at_rest = json.truth_or("starts_at_rest", false);
  if (json.has("gravity_m_s2")) trial.gravity_m_s2 = to_vector(json.numbers("gravity_m_s2", 3));
  if (json.has("camera")) trial.camera = read_projection(json.child("camera"));
  if (json.has("projector")) {
    const JsonReader projector = json.child("projector");
    trial.projector = read_projection(projector);
    if (projector.has("pattern")) trial.pattern = read_pattern(projector.child("pattern"));
  }
  read_rates(json, trial);
}

// What trial.json says of surface.csv.
void read_seen_from(const JsonReader& json, Surface& surface) {
  if (!json.has("surface")) return;
  const JsonReader keys = json.child("surface");
  if (keys.has("seen_from_m")) surface.seen_from_m = to_vector(keys.numbers("seen_from_m", 3));
}

std::vector<double> column(const CsvTable& table, size_t index) {
  std::vector<double> values(table.rows());
  for (size_t row = 0; row < values.size(); ++row) values[row] = table(row, index);
  return values;
}

// Three columns from `first` as points; all three NaN where one is.
Eigen::Matrix3Xd points(const CsvTable& table, size_t first) {
  Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(table.rows()));
  for (size_t row = 0; row < table.rows(); ++row) {
    auto point = result.col(static_cast<Eigen::Index>(row));
    for (int axis = 0; axis < 3; ++axis) point(axis) = table(row, first + axis);
    if (point.hasNaN()) point.setConstant(std::nan(""));
  }
  return result;
}

Corners read_corners(const CsvTable& table, bool whole) {
  Corners corners{column(table, 0), points(table, 1), points(table, 4)};
  for (const auto* corner : {&corners.left, &corners.right})
    if (whole && corner->array().isNaN().all())
      refuse(table.path.string(), "found no sample in which the {} corner is seen, expected at least one",
             corner == &corners.left ? "left" : "right");
  return corners;
}

// Listed images that are not as they were written, one after another for the same reason: one sentence.
void name_images(const std::vector<std::pair<int, std::string>>& images, std::vector<std::string>& damaged) {
  for (size_t i = 0; i < images.size();) {
    size_t next = i + 1;
    while (next < images.size() && images[next].second == images[i].second &&
           images[next].first == images[next - 1].first + 1)
      ++next;
    std::string text = fmt::format("frames/{:06d}.png", images[i].first);
    if (next > i + 1) text += fmt::format(" to {:06d}.png", images[next - 1].first);
    damaged.push_back(text + ": " + images[i].second);
    i = next;
  }
}

// table: times, numbers, and where the trial has checksums the images'.
Frames read_frames(const fs::path& folder, const CsvTable& table, bool checked, std::vector<std::string>& damaged) {
  Frames frames;
  std::vector<std::pair<int, std::string>> damaged_images;
  int last = -1;
  for (size_t row = 0; row < table.rows(); ++row) {
    const int number = files::whole_number(table, row, 1, "frame");
    if (number < 0) refuse(table.where(row), "frame: found {}, expected 0 or more", number);
    if (number <= last) refuse(table.where(row), "frame: found {} after {}, expected numbers that rise", number, last);
    last = number;
    const fs::path path = frame_path(folder, number);
    if (checked) {
      const std::string damage = image_damage(path, static_cast<uint32_t>(table(row, 2)));
      if (!damage.empty()) damaged_images.emplace_back(number, damage);
      if (!damage.empty()) continue;
    }
    std::error_code error;
    if (!fs::exists(path, error))
      refuse(table.where(row), "frame {} is listed, but found no file frames/{:06d}.png", number, number);
    frames.number.push_back(number);
    frames.time_s.push_back(table(row, 0));
    frames.path.push_back(path);
  }
  name_images(damaged_images, damaged);
  return frames;
}

void require_camera_size(const geometry::Projection& camera, int width_px, int height_px, const fs::path& path) {
  if (width_px != camera.width_px || height_px != camera.height_px)
    refuse(path.string(), "found an image of {}x{} px, expected the camera's {}x{} px", width_px, height_px,
           camera.width_px, camera.height_px);
}

Markers read_markers(const CsvTable& table) {
  Markers markers;
  markers.time_s = column(table, 0);
  markers.position = points(table, 4);
  markers.marker.reserve(table.rows());
  markers.uv.reserve(table.rows());
  for (size_t row = 0; row < table.rows(); ++row) {
    markers.marker.push_back(files::whole_number(table, row, 1, "marker"));
    markers.uv.emplace_back(table(row, 2), table(row, 3));
  }
  return markers;
}

// Whether trial.json or a frames folder promises images.
bool images_promised(const JsonReader& json, const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder / "frames", error)) return true;
  return json.has("frames") && json.child("frames").number_or("count", 0) > 0;
}

void read_images(const JsonReader& json, const TableReader& tables, Trial& trial) {
  const bool complete = trial.state == State::complete;
  std::vector<files::CsvColumn> wanted = {{"t_s"}, {"frame"}};
  if (tables.checked()) wanted.push_back({"image_crc32"});
  const auto table = tables.read("frames.csv", wanted, complete && images_promised(json, trial.folder));
  if (!table) return;
  if (!trial.camera) refuse(json.where("camera"), "found no such key, expected it because the trial has images");
  Frames frames = read_frames(trial.folder, *table, tables.checked(), trial.damaged);
  for (const fs::path& path : frames.path) {
    const PngSize size = read_png_size(path);
    require_camera_size(*trial.camera, size.width_px, size.height_px, path);
  }
  if (!frames.number.empty()) trial.frames = std::move(frames);
  // With checksums, TableReader has named what is missing.
  if (!complete || tables.checked() || !json.has("frames") || !json.child("frames").has("count")) return;
  const double count = json.child("frames").number("count");
  if (count != static_cast<double>(trial.frames->number.size()))
    refuse((trial.folder / "frames.csv").string(), "found {} frames, expected {} as trial.json says (frames.count)",
           trial.frames->number.size(), count);
}

void read_tables(const JsonReader& json, const TableReader& tables, Trial& trial) {
  const bool complete = trial.state == State::complete;
  const auto corners = tables.read("corners.csv",
                                   {{"t_s"},
                                    {"left_x", true},
                                    {"left_y", true},
                                    {"left_z", true},
                                    {"right_x", true},
                                    {"right_y", true},
                                    {"right_z", true}},
                                   complete);
  if (corners) trial.corners = read_corners(*corners, complete && trial.damaged.empty());
  read_images(json, tables, trial);
  if (const auto markers =
          tables.read("markers.csv", {{"t_s"}, {"marker"}, {"u_m"}, {"v_m"}, {"x"}, {"y"}, {"z"}}, false))
    trial.markers = read_markers(*markers);
  if (const auto surface = tables.read("surface.csv", {{"t_s"}, {"x"}, {"y"}, {"z"}}, false)) {
    trial.surface = Surface{column(*surface, 0), points(*surface, 1), {}};
    read_seen_from(json, *trial.surface);
  }
  if (complete && !trial.frames && !trial.markers && !trial.surface && trial.damaged.empty())
    refuse(trial.folder.string(),
           "found none of frames.csv, markers.csv and surface.csv, expected at least one of them");
  if (const auto robot = tables.read(
          "robot.csv",
          {{"t_s"}, {"commanded_x"}, {"commanded_y"}, {"commanded_z"}, {"measured_x"}, {"measured_y"}, {"measured_z"}},
          false))
    trial.robot = Robot{column(*robot, 0), points(*robot, 1), points(*robot, 4)};
}

// trial.json that still reads but is not what was written; and the copy that would stand in for it.
void name_changed_json(const fs::path& folder, const nlohmann::json& object, std::vector<std::string>& damaged) {
  if (!is_as_written(object))
    damaged.push_back("trial.json: not as it was written (its checksum differs): damaged, or edited by hand");
  if (!has_checksums(object)) return;
  try {
    const nlohmann::json copy = files::read_json(folder / copy_name);
    if (!copy.is_object() || !copy.contains("crc32") || !is_as_written(copy))
      damaged.push_back(fmt::format("{}: damaged", copy_name));
  } catch (const BadInput& unreadable) { damaged.push_back(unreadable.what()); }
}

}  // namespace

Trial read_header(const fs::path& trial_json) {
  Trial trial;
  read_trial_json(JsonReader(trial_json), trial);
  return trial;
}

Trial read_trial(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) refuse(folder.string(), "found no such folder, expected a trial or campaign");
  const JsonReader json(folder / "trial.json");
  Trial trial;
  trial.folder = folder;
  trial.name = (fs::absolute(folder) / "").lexically_normal().parent_path().filename().string();
  read_trial_json(json, trial);
  name_changed_json(folder, json.object(), trial.damaged);
  // What a mended trial had lost before.
  if (json.has("damaged"))
    for (const std::string& sentence : json.texts("damaged")) trial.damaged.push_back(sentence);
  if (is_material_test(trial.experiment)) read_material_tables(json, trial);
  else read_tables(json, TableReader(folder, trial.state, json.object(), trial.damaged), trial);
  return trial;
}

GreyImage read_frame(const Trial& trial, size_t index) {
  if (!trial.frames || !trial.camera || index >= trial.frames->path.size())
    throw std::out_of_range(fmt::format("read_frame: trial {} has no frame at index {}", trial.name, index));
  const fs::path& path = trial.frames->path[index];
  GreyImage image = read_grey_png(path);
  require_camera_size(*trial.camera, static_cast<int>(image.cols()), static_cast<int>(image.rows()), path);
  return image;
}

const char* to_text(Experiment experiment) { return experiment_texts[static_cast<size_t>(experiment)].c_str(); }
const char* to_text(Held held) { return held_texts[static_cast<size_t>(held)].c_str(); }
const char* to_text(State state) { return state_texts[static_cast<size_t>(state)].c_str(); }

}  // namespace selvedge::trial
