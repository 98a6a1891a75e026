#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "capture/trial/grey_png.h"
#include "capture/trial/trial.h"
#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/csv_table.h"
#include "files/json_reader.h"

namespace selvedge::trial {

namespace fs = std::filesystem;
using files::CsvTable;
using files::JsonReader;

namespace {

const std::vector<std::string> experiment_texts = {"static", "waving", "robot"};
const std::vector<std::string> held_texts = {"corners", "top_edge", "top_edge_clamped"};
const std::vector<std::string> state_texts = {"complete", "cut", "recording"};

Eigen::Vector3d to_vector(const std::vector<double>& numbers) { return {numbers[0], numbers[1], numbers[2]}; }

void require_rank_three(const geometry::Projection& projection, const std::string& where) {
  const Eigen::Vector3d values = geometry::singular_values(projection.matrix);
  if (!(values(2) > 1e-9 * values(0)))
    refuse(where, "found a matrix of rank {}, expected rank 3 (singular values {:.3g}, {:.3g}, {:.3g} with rows of "
           "length 1)", static_cast<int>((values.array() > 1e-9 * values(0)).count()), values(0), values(1), values(2));
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
  if (!rows.is_array() || rows.size() != 3)
    refuse(where, "found {}, expected 3 rows of 4 numbers", files::shown(rows));
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

Fabric read_fabric(const JsonReader& json) {
  Fabric fabric;
  if (json.has("name")) fabric.name = json.text("name");
  fabric.width_m = json.positive("width_m");
  fabric.height_m = json.positive("height_m");
  fabric.mass_kg = json.positive("mass_kg");
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

// A table with times in column 0 and at least one row.
CsvTable read_timed(const fs::path& path, const std::vector<files::CsvColumn>& wanted, State state) {
  CsvTable table = files::read_csv(path, wanted, state != State::complete);
  if (table.rows() == 0) refuse(path.string(), "found a header and no rows, expected at least one");
  files::require_times_ascend(table, 0);
  return table;
}

Corners read_corners(const fs::path& path, State state) {
  const CsvTable table = read_timed(path, {{"t_s"}, {"left_x", true}, {"left_y", true}, {"left_z", true},
                                           {"right_x", true}, {"right_y", true}, {"right_z", true}}, state);
  Corners corners{column(table, 0), points(table, 1), points(table, 4)};
  for (const auto* corner : {&corners.left, &corners.right})
    if (state == State::complete && corner->array().isNaN().all())
      refuse(path.string(), "found no sample in which the {} corner is seen, expected at least one",
             corner == &corners.left ? "left" : "right");
  return corners;
}

Frames read_frames(const fs::path& folder, State state) {
  const CsvTable table = read_timed(folder / "frames.csv", {{"t_s"}, {"frame"}}, state);
  Frames frames;
  frames.time_s = column(table, 0);
  for (size_t row = 0; row < table.rows(); ++row) {
    const int number = files::whole_number(table, row, 1, "frame");
    if (number < 0) refuse(table.where(row), "frame: found {}, expected 0 or more", number);
    if (row > 0 && number <= frames.number.back())
      refuse(table.where(row), "frame: found {} after {}, expected numbers that rise", number, frames.number.back());
    frames.number.push_back(number);
    frames.path.push_back(frame_path(folder, number));
    std::error_code error;
    if (!fs::exists(frames.path.back(), error))
      refuse(table.where(row), "frame {} is listed, but found no file frames/{:06d}.png", number, number);
  }
  return frames;
}

void require_camera_size(const geometry::Projection& camera, int width_px, int height_px, const fs::path& path) {
  if (width_px != camera.width_px || height_px != camera.height_px)
    refuse(path.string(), "found an image of {}x{} px, expected the camera's {}x{} px", width_px, height_px,
           camera.width_px, camera.height_px);
}

Markers read_markers(const fs::path& path, State state) {
  const CsvTable table =
      read_timed(path, {{"t_s"}, {"marker"}, {"u_m"}, {"v_m"}, {"x"}, {"y"}, {"z"}}, state);
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

Robot read_robot(const fs::path& path, State state) {
  const CsvTable table = read_timed(path, {{"t_s"}, {"commanded_x"}, {"commanded_y"}, {"commanded_z"},
                                           {"measured_x"}, {"measured_y"}, {"measured_z"}}, state);
  return {column(table, 0), points(table, 1), points(table, 4)};
}

// Whether a table that a trial may lack is to be read. A recorder that was cut off leaves a table that it had only just
// begun without a whole row: there is nothing in it yet, and what else was recorded is to be read all the same.
bool is_recorded(const fs::path& path, State state) {
  std::error_code error;
  if (!fs::exists(path, error)) return false;
  if (state == State::complete) return true;
  const std::string bytes = files::read_whole(path);
  return std::count(bytes.begin(), bytes.end(), '\n') > 1;
}

// Whether trial.json or a frames folder promises images.
bool images_promised(const JsonReader& json, const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder / "frames", error)) return true;
  return json.has("frames") && json.child("frames").number_or("count", 0) > 0;
}

void read_images(const JsonReader& json, Trial& trial) {
  trial.frames = read_frames(trial.folder, trial.state);
  if (!trial.camera) refuse(json.where("camera"), "found no such key, expected it because the trial has images");
  for (const fs::path& path : trial.frames->path) {
    const PngSize size = read_png_size(path);
    require_camera_size(*trial.camera, size.width_px, size.height_px, path);
  }
  if (trial.state != State::complete || !json.has("frames") || !json.child("frames").has("count")) return;
  const double count = json.child("frames").number("count");
  if (count != static_cast<double>(trial.frames->number.size()))
    refuse((trial.folder / "frames.csv").string(), "found {} frames, expected {} as trial.json says (frames.count)",
           trial.frames->number.size(), count);
}

}  // namespace

Trial read_trial(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) refuse(folder.string(), "found no such folder, expected a trial or campaign");
  const JsonReader json(folder / "trial.json");
  Trial trial;
  trial.folder = folder;
  trial.name = (fs::absolute(folder) / "").lexically_normal().parent_path().filename().string();
  read_trial_json(json, trial);
  const bool is_complete = trial.state == State::complete;
  if (is_complete || is_recorded(folder / "corners.csv", trial.state)) trial.corners = read_corners(folder / "corners.csv", trial.state);
  const bool has_frames = is_recorded(folder / "frames.csv", trial.state) || (is_complete && images_promised(json, folder));
  const bool has_markers = is_recorded(folder / "markers.csv", trial.state);
  if (is_complete && !has_frames && !has_markers)
    refuse(folder.string(), "found neither frames.csv nor markers.csv, expected one of them or both");
  if (has_frames) read_images(json, trial);
  if (has_markers) trial.markers = read_markers(folder / "markers.csv", trial.state);
  if (is_recorded(folder / "robot.csv", trial.state)) trial.robot = read_robot(folder / "robot.csv", trial.state);
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
