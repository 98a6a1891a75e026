#include "console/run_folder.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/trial/trial.h"
#include "console/gate.h"
#include "files/bad_input.h"
#include "files/json_number.h"
#include "files/whole_file.h"
#include "render/stripe_renderer.h"
#include "station/confirmation.h"
#include "station/diagnosis_folder.h"
#include "station/journal.h"
#include "station/motion_file.h"

namespace selvedge::console {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kDepth = 3;  // RUN/FABRIC/TRIAL

// Files of a name below the run, in order of path.
std::vector<fs::path> found(const fs::path& folder, const std::string& name) {
  std::vector<fs::path> files;
  std::error_code error;
  fs::recursive_directory_iterator walk(folder, fs::directory_options::skip_permission_denied, error);
  for (; !error && walk != fs::recursive_directory_iterator(); walk.increment(error)) {
    if (walk.depth() >= kDepth || walk->path().filename() == "frames") walk.disable_recursion_pending();
    if (walk->path().filename() == name && walk->is_regular_file()) files.push_back(walk->path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

json parsed(const fs::path& path) {
  try {
    json value = files::read_json(path);
    return value.is_object() ? value : json::object();
  } catch (const std::exception&) {
    return json::object();  // being written, or no good: the console shows what there is
  }
}

// Empty where it is no text.
std::string text_at(const json& object, const char* key) {
  const json value = object.value(key, json());
  return value.is_string() ? value.get<std::string>() : "";
}

json track(const Eigen::Matrix3Xd& positions) {
  json out = json::array();
  for (Eigen::Index i = 0; i < positions.cols(); ++i)
    out.push_back({files::finite_or_null(positions(0, i)), files::finite_or_null(positions(1, i)),
                   files::finite_or_null(positions(2, i))});
  return out;
}

// A trial.json whose keys are of another kind than ours has no name here but its folder's.
json about_trial(const fs::path& trial_json) {
  json out = json::object();
  const json about = parsed(trial_json);
  try {
    out = {{"kind", about.value("experiment", "")},
           {"state", about.value("state", "complete")},
           {"at_rest", about.value("starts_at_rest", false)}};
    if (about.contains("fabric")) out["fabric"] = about["fabric"].value("name", "");
    if (about.contains("cut_because")) out["why"] = about["cut_because"].get<std::string>();
    if (!about.contains("frames") || !about["frames"].is_object()) return out;
    out["frames"] = about["frames"].value("count", 0.0);
    double lost = 0;
    for (const json& gap : about["frames"].value("gaps", json::array()))
      lost += gap.at(1).get<double>() - gap.at(0).get<double>() + 1;
    out["frames_lost"] = lost;
  } catch (const json::exception&) {
    out["state"] = "unreadable";
    out["why"] = "trial.json says something else than a trial's does";
  }
  return out;
}

// What the trial's own files say of its checks.
json trial_entry(const fs::path& folder, const fs::path& trial_json) {
  const fs::path trial = trial_json.parent_path();
  const std::string name = trial.filename().string();
  json out = about_trial(trial_json);
  out["path"] = fs::relative(trial, folder).generic_string();
  out["name"] = name;
  out["kept_aside"] = name.find("-spoiled-") != std::string::npos;
  out["simulated"] = fs::exists(station::motion_path(trial.parent_path(), name));
  return out;
}

}  // namespace

fs::path RunFolder::trial_folder(const std::string& path) const {
  const auto folder = folder_below(folder_, path);
  if (!folder || !fs::is_regular_file(*folder / "trial.json")) refuse("trial", "no trial {}", in_quotes(path));
  return *folder;
}

json RunFolder::trials() const {
  json out = json::array();
  for (const fs::path& file : found(folder_, "trial.json")) out.push_back(trial_entry(folder_, file));
  return out;
}

json RunFolder::trial(const std::string& path) const {
  const fs::path folder = trial_folder(path);
  const trial::Trial trial = trial::read_trial(folder);
  json out = trial_entry(fs::weakly_canonical(folder_), folder / "trial.json");
  out["path"] = path;
  out["width_m"] = trial.fabric.width_m;
  out["corners"] = {
      {"time_s", trial.corners.time_s}, {"left", track(trial.corners.left)}, {"right", track(trial.corners.right)}};
  out["frame_time_s"] = trial.frames ? trial.frames->time_s : std::vector<double>{};
  if (trial.robot) out["robot"] = {{"time_s", trial.robot->time_s}, {"measured", track(trial.robot->measured)}};
  if (!out["simulated"].get<bool>()) return out;
  const json header = parsed(station::motion_path(folder.parent_path(), trial.name));
  out["motion"] = {{"time_s", header.value("time_s", json::array())},
                   {"triangles", header.value("triangles", json::array())},
                   {"vertices", header.value("uv_m", json::array()).size()}};
  return out;
}

std::string RunFolder::frame(const std::string& path, size_t index) const {
  const trial::Trial trial = trial::read_trial(trial_folder(path));
  if (!trial.frames || index >= trial.frames->path.size())
    refuse("frame", "found {}, the trial has {}", index, trial.frames ? trial.frames->path.size() : 0);
  return files::read_whole(trial.frames->path[index]);
}

std::string RunFolder::simulated_frame(const std::string& path, size_t index) const {
  const fs::path folder = trial_folder(path);
  const trial::Trial trial = trial::read_trial(folder);
  if (!trial.frames || index >= trial.frames->time_s.size())
    refuse("frame", "found {}, the trial has {}", index, trial.frames ? trial.frames->path.size() : 0);
  if (!trial.camera || !trial.projector || !trial.pattern) refuse(path, "has no camera, projector or pattern");
  const station::SimulatedMotion motion = station::read_simulated_motion(folder.parent_path(), trial.name);
  const double time_s = trial.frames->time_s[index];
  const auto at = std::min_element(motion.time_s.begin(), motion.time_s.end(),
                                   [&](double a, double b) { return std::abs(a - time_s) < std::abs(b - time_s); });
  // Frames from before the tracker's first sample are not fitted; a sheet that rests lies there as at the first that
  // is.
  const bool rests = at == motion.time_s.begin() && at != motion.time_s.end() && time_s < *at && trial.starts_at_rest;
  if (at == motion.time_s.end() || (std::abs(*at - time_s) > 0.02 && !rests))
    refuse(path, "the fit simulated nothing at {:.3f} s", time_s);
  render::StripePattern pattern;
  pattern.horizontal = trial.pattern->orientation == "horizontal";
  pattern.period_px = trial.pattern->period_px;
  pattern.duty = trial.pattern->duty;
  pattern.first_bright_px = trial.pattern->first_bright_row_px;
  const std::lock_guard lock(rendering_);
  render::StripeRenderer renderer(*trial.camera, *trial.projector);
  renderer.set_pattern(pattern);
  const render::Image image = renderer.render(
      motion.position[static_cast<size_t>(at - motion.time_s.begin())].cast<double>(), motion.triangles);
  return trial::encode_grey_png(image.data(), static_cast<int>(image.cols()), static_cast<int>(image.rows()), 1);
}

std::string RunFolder::motion(const std::string& path) const {
  const fs::path folder = trial_folder(path);
  return files::read_whole(
      fs::path(station::motion_path(folder.parent_path(), folder.filename().string())).replace_extension(".f32"));
}

json RunFolder::session() const {
  json out = {{"name", fs::weakly_canonical(folder_).filename().string()},
              {"steps", json::array()},
              {"fits", json::array()},
              {"diagnoses", json::array()},
              {"reports", json::array()}};
  for (const auto& [id, record] : station::read_journal(folder_))
    out["steps"].push_back({{"step", id},
                            {"state", station::to_text(record.state)},
                            {"attempts", record.attempts},
                            {"seconds", record.seconds},
                            {"why", record.why}});
  const auto name_of = [&](const fs::path& file) { return fs::relative(file.parent_path(), folder_).generic_string(); };
  for (const fs::path& file : found(folder_, "fit.json")) {
    const json fit = parsed(file);
    out["fits"].push_back({{"path", name_of(file)},
                           {"campaign", text_at(fit, "campaign")},
                           {"parameters", fit.value("parameters", json::object())},
                           {"held_out", fit.value("held_out", json::object())}});
  }
  for (const fs::path& file : found(folder_, "diagnosis.json")) {
    const json d = parsed(file);
    out["diagnoses"].push_back({{"path", name_of(file)},
                                {"campaign", text_at(d, "campaign")},
                                {"cause", text_at(d, "cause")},
                                {"side", text_at(d, "side")},
                                {"gap", d.value("gap", json::object())},
                                {"probabilities", d.value("probabilities", json::object())},
                                {"next_experiment", d.value("next_experiment", json::object())}});
    // A second session follows the first diagnosis alone.
    const fs::path fabric = file.parent_path().parent_path();
    if (file.parent_path().filename() != station::diagnosis_folder_name(0)) continue;
    if (const json c = parsed(fabric / station::kConfirmationFolder / "confirmation.json"); !c.empty())
      out["diagnoses"].back()["confirmation"] = c.value("verdict", json::object()).value("sentence", "");
  }
  for (const fs::path& file : found(folder_, "report.html"))
    out["reports"].push_back(fs::relative(file, folder_).generic_string());
  if (const json calibration = parsed(folder_ / "calibration.json"); !calibration.empty())
    out["calibration"] = {{"verdict", text_at(calibration, "verdict")},
                          {"camera", calibration.value("camera", json::object())},
                          {"projector", calibration.value("projector", json::object())}};
  return out;
}

std::optional<fs::path> RunFolder::shown_file(const std::string& path) const {
  static const std::vector<std::string> shown = {".html", ".json", ".csv", ".png", ".svg", ".toml"};
  const auto file = file_below(folder_, path);
  if (!file || std::find(shown.begin(), shown.end(), file->extension()) == shown.end()) return std::nullopt;
  return file;
}

}  // namespace selvedge::console
