#include "capture/trial/trial_writer.h"

#include <stdexcept>

#include <fmt/format.h>

#include "capture/trial/material_test_files.h"
#include "files/csv_table.h"
#include "files/whole_file.h"

namespace selvedge::trial {

namespace fs = std::filesystem;
using files::append_number;
using nlohmann::json;

namespace {

json to_json(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

json to_json(const geometry::Projection& projection) {
  json rows = json::array();
  for (int i = 0; i < 3; ++i) {
    const auto& p = projection.matrix;
    rows.push_back({p(i, 0), p(i, 1), p(i, 2), p(i, 3)});
  }
  return {{"width_px", projection.width_px},
          {"height_px", projection.height_px},
          {"projection", rows},
          {"distortion", projection.distortion}};
}

json to_json(const StripePattern& pattern) {
  return {{"kind", "stripes"},
          {"orientation", pattern.orientation},
          {"period_px", pattern.period_px},
          {"duty", pattern.duty},
          {"first_bright_row_px", pattern.first_bright_row_px}};
}

void append_point(std::string& text, const Eigen::Matrix3Xd& points, size_t index) {
  const auto point = points.col(static_cast<Eigen::Index>(index));
  for (int axis = 0; axis < 3; ++axis) {
    text += ',';
    if (!point.hasNaN()) append_number(text, point(axis));
  }
}

std::string corners_csv(const Corners& corners) {
  std::string text = corners_header;
  for (size_t i = 0; i < corners.time_s.size(); ++i) {
    append_number(text, corners.time_s[i]);
    append_point(text, corners.left, i);
    append_point(text, corners.right, i);
    text += '\n';
  }
  return text;
}

std::string frames_csv(const Frames& frames) {
  std::string text = frames_header;
  for (size_t i = 0; i < frames.number.size(); ++i) {
    text += std::to_string(frames.number[i]) + ',';
    append_number(text, frames.time_s[i]);
    text += '\n';
  }
  return text;
}

std::string markers_csv(const Markers& markers) {
  std::string text = markers_header;
  for (size_t i = 0; i < markers.time_s.size(); ++i) {
    append_number(text, markers.time_s[i]);
    text += ',' + std::to_string(markers.marker[i]) + ',';
    append_number(text, markers.uv[i].x());
    text += ',';
    append_number(text, markers.uv[i].y());
    append_point(text, markers.position, i);
    text += '\n';
  }
  return text;
}

std::string surface_csv(const Surface& surface) {
  std::string text = surface_header;
  for (size_t i = 0; i < surface.time_s.size(); ++i) {
    append_number(text, surface.time_s[i]);
    append_point(text, surface.position, i);
    text += '\n';
  }
  return text;
}

std::string robot_csv(const Robot& robot) {
  std::string text = robot_header;
  for (size_t i = 0; i < robot.time_s.size(); ++i) {
    append_number(text, robot.time_s[i]);
    append_point(text, robot.commanded, i);
    append_point(text, robot.measured, i);
    text += '\n';
  }
  return text;
}

void write_images(const Frames& frames, const fs::path& folder, const std::vector<GreyImage>& images) {
  if (images.empty()) return;
  if (images.size() != frames.number.size())
    throw std::invalid_argument(
        fmt::format("write_trial: {} images for {} frames", images.size(), frames.number.size()));
  fs::create_directories(folder / "frames");
  for (size_t i = 0; i < images.size(); ++i)
    files::write_whole(
        frame_path(folder, frames.number[i]),
        encode_grey_png(images[i].data(), static_cast<int>(images[i].cols()), static_cast<int>(images[i].rows()), 6));
}

}  // namespace

fs::path frame_path(const fs::path& folder, int number) {
  return folder / "frames" / fmt::format("{:06d}.png", number);
}

json trial_to_json(const Trial& trial) {
  json value = {{"format", "trial/1"},
                {"experiment", to_text(trial.experiment)},
                {"state", to_text(trial.state)},
                {"fabric",
                 {{"name", trial.fabric.name},
                  {"width_m", trial.fabric.width_m},
                  {"height_m", trial.fabric.height_m},
                  {"mass_kg", trial.fabric.mass_kg},
                  {"mass_known", trial.fabric.mass_known}}},
                {"gravity_m_s2", to_json(trial.gravity_m_s2)}};
  if (is_material_test(trial.experiment)) {
    add_material_test(trial, value);
    return value;
  }
  value["held"] = to_text(trial.held);
  value["starts_at_rest"] = trial.starts_at_rest;
  value["frames"] = {{"rate_hz", trial.frame_rate_hz},
                     {"exposure_s", trial.exposure_s},
                     {"count", trial.frames ? trial.frames->number.size() : 0}};
  value["mocap"] = {{"rate_hz", trial.mocap_rate_hz}};
  if (trial.held == Held::top_edge_clamped) value["clamp_direction"] = to_json(trial.clamp_direction);
  if (trial.camera) value["camera"] = to_json(*trial.camera);
  if (trial.projector) value["projector"] = to_json(*trial.projector);
  if (trial.projector && trial.pattern) value["projector"]["pattern"] = to_json(*trial.pattern);
  if (trial.surface && trial.surface->seen_from_m)
    value["surface"] = {{"seen_from_m", to_json(*trial.surface->seen_from_m)}};
  if (trial.mocap_noise_m) value["mocap"]["noise_m"] = *trial.mocap_noise_m;
  if (trial.noise_grey_levels) value["noise_grey_levels"] = *trial.noise_grey_levels;
  return value;
}

void write_trial(const Trial& trial, const fs::path& folder, const std::vector<GreyImage>& images) {
  fs::create_directories(folder);
  if (trial.frames) {
    write_images(*trial.frames, folder, images);
    files::write_whole(folder / "frames.csv", frames_csv(*trial.frames));
  }
  if (trial.markers) files::write_whole(folder / "markers.csv", markers_csv(*trial.markers));
  if (trial.surface) files::write_whole(folder / "surface.csv", surface_csv(*trial.surface));
  if (trial.robot) files::write_whole(folder / "robot.csv", robot_csv(*trial.robot));
  write_material_tables(trial, folder);
  if (!is_material_test(trial.experiment)) files::write_whole(folder / "corners.csv", corners_csv(trial.corners));
  files::write_json(folder / "trial.json", trial_to_json(trial));
}

void write_campaign(const Campaign& campaign, const fs::path& folder) {
  for (const Trial& trial : campaign.trials) write_trial(trial, folder / trial.name);
  write_campaign_json(campaign, folder);
}

void write_campaign_json(const Campaign& campaign, const fs::path& folder) {
  json trials = json::array();
  for (const Trial& trial : campaign.trials) trials.push_back(trial.name);
  fs::create_directories(folder);
  files::write_json(
      folder / "campaign.json",
      {{"format", "campaign/1"}, {"fabric", campaign.fabric}, {"trials", trials}, {"replicates", campaign.replicates}});
}

}  // namespace selvedge::trial
