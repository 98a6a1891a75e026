#include "capture/recovery.h"

#include <algorithm>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "capture/recorder.h"
#include "capture/trial/checked_trial.h"
#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/checked_lines.h"
#include "files/csv_table.h"
#include "files/durable.h"
#include "files/lock.h"
#include "files/whole_file.h"

namespace selvedge::capture {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr const char* kAside = ".damaged";

// Why a trial.json, or its copy, is none; empty where it is one. By the same reader that reads trials.
std::string refusal_of(const fs::path& trial_json) {
  try {
    trial::read_header(trial_json);
    return "";
  } catch (const BadInput& error) { return error.what(); }
}

bool is_whole_copy(const fs::path& path) {
  if (!refusal_of(path).empty()) return false;
  const json value = files::read_json(path);
  return value.contains("crc32") && trial::is_as_written(value);
}

// "40 rows of corners.csv, 6 rows of frames.csv": lines that are as they were written, whatever trial.json says.
std::string lines_that_read(const fs::path& folder) {
  std::string text;
  for (const char* name : trial::table_names) {
    std::error_code error;
    if (!fs::is_regular_file(folder / name, error)) continue;
    const size_t rows = files::read_checked_lines(folder / name, trial::checked_header(name)).rows;
    if (rows > 0) text += fmt::format("{}{} rows of {}", text.empty() ? "" : ", ", rows, name);
  }
  return text.empty() ? "no line of a table" : text;
}

// Puts trial.json back from its copy where it does not read, and the copy where it is the damaged one.
void mend_trial_json(const fs::path& folder, Recovery& recovery) {
  const fs::path file = folder / "trial.json", copy = folder / trial::copy_name;
  const std::string refusal = refusal_of(file);
  if (!refusal.empty()) {
    std::error_code error;
    if (!fs::exists(copy, error)) throw BadInput(refusal);  // a trial of others
    if (!is_whole_copy(copy))
      refuse(folder.string(), "trial.json and {} are both damaged ({}), expected one that reads; {} can still be read",
             trial::copy_name, refusal, lines_that_read(folder));
    if (fs::exists(file, error)) fs::rename(file, file.string() + kAside);
    files::write_whole(file, files::read_whole(copy));
    recovery.done.push_back(fmt::format("trial.json did not read and was put back from {}", trial::copy_name));
    return;
  }
  const json value = files::read_json(file);
  if (!trial::has_checksums(value) || !trial::is_as_written(value) || is_whole_copy(copy)) return;
  files::write_json(copy, value);
  recovery.done.push_back(fmt::format("{} was damaged and written anew", trial::copy_name));
}

// A line as it stands in the table, without its line break.
std::vector<std::string> rows_of(const std::string& text) {
  std::vector<std::string> rows;
  for (size_t start = text.find('\n') + 1, end; (end = text.find('\n', start)) != std::string::npos; start = end + 1)
    rows.push_back(text.substr(start, end - start));
  return rows;
}

// Rows of frames.csv whose images are whole; the images that are not are put aside.
std::string with_whole_images(const fs::path& folder, const std::string& text) {
  const files::CsvTable table = files::parse_csv(folder / "frames.csv", text, {{"frame"}, {"image_crc32"}});
  const std::vector<std::string> rows = rows_of(text);
  std::string kept = text.substr(0, text.find('\n') + 1);
  for (size_t row = 0; row < rows.size(); ++row) {
    const fs::path image = trial::frame_path(folder, files::whole_number(table, row, 0, "frame"));
    const std::string damage = trial::image_damage(image, static_cast<uint32_t>(table(row, 1)));
    if (damage.empty()) kept += rows[row] + '\n';
    else if (damage != "missing") fs::rename(image, image.string() + kAside);
  }
  return kept;
}

// Leaves the lines that are as they were written. Returns how many those are.
size_t mend_checked_table(const fs::path& folder, const std::string& name) {
  const fs::path path = folder / name;
  if (!fs::exists(path)) return 0;
  const files::CheckedLines lines = files::read_checked_lines(path, trial::checked_header(name));
  const std::string kept = name == "frames.csv" && lines.rows > 0 ? with_whole_images(folder, lines.text) : lines.text;
  const std::vector<std::string> rows = rows_of(kept);
  const bool torn_alone = lines.damaged.empty() && (!lines.header_damaged || lines.rows == 0);
  if (!torn_alone) fs::copy_file(path, path.string() + kAside, fs::copy_options::overwrite_existing);
  if (rows.empty()) fs::remove(path);
  else if (!lines.sound() || rows.size() != lines.rows) files::write_whole(path, kept);
  return rows.size();
}

// The same where lines carry no checksums: only a torn last line shows.
void cut_torn_line(const fs::path& path) {
  if (!fs::exists(path)) return;
  const std::string text = files::read_whole(path);
  const size_t whole = text.rfind('\n') + 1;  // npos + 1 is 0
  if (whole == 0) fs::remove(path);
  else if (whole < text.size()) files::write_whole(path, text.substr(0, whole));
}

std::vector<int> listed_frames(const fs::path& folder) {
  std::vector<int> numbers;
  if (!fs::exists(folder / "frames.csv")) return numbers;
  const files::CsvTable table = files::read_csv(folder / "frames.csv", {{"frame"}});
  for (size_t row = 0; row < table.rows(); ++row) numbers.push_back(files::whole_number(table, row, 0, "frame"));
  return numbers;
}

// An image without a row has no time, and nobody was told of it.
void remove_unlisted_images(const fs::path& folder, const std::vector<int>& numbers) {
  if (!fs::exists(folder / "frames")) return;
  std::set<fs::path> listed;
  for (const int number : numbers) listed.insert(trial::frame_path(folder, number).filename());
  std::vector<fs::path> unlisted;
  for (const auto& entry : fs::directory_iterator(folder / "frames"))
    if (!listed.count(entry.path().filename()) && entry.path().extension() != kAside) unlisted.push_back(entry.path());
  for (const fs::path& path : unlisted) fs::remove(path);
  if (fs::is_empty(folder / "frames")) fs::remove(folder / "frames");
  else files::sync_folder(folder / "frames");
}

// damaged: what the trial had lost before it was mended.
void mend_recording(const fs::path& folder, const std::vector<std::string>& damaged) {
  json value = files::read_json(folder / "trial.json");
  const bool checked = trial::has_checksums(value);
  json rows = json::object();
  for (const char* name : trial::table_names) {
    if (checked) rows[name] = mend_checked_table(folder, name);
    else cut_torn_line(folder / name);
  }
  const std::vector<int> numbers = listed_frames(folder);
  remove_unlisted_images(folder, numbers);
  fs::remove(folder / ".reserve");
  files::sync_folder(folder);
  value["state"] = to_text(trial::State::cut);
  value["cut_because"] = "the recorder ended without finishing the trial";
  value["frames"]["count"] = numbers.size();
  value["frames"]["gaps"] = number_gaps(numbers);
  if (!checked) {
    files::write_json(folder / "trial.json", value);
    return;
  }
  value["rows"] = rows;
  if (!damaged.empty()) value["damaged"] = damaged;
  trial::write_checked_json(folder, value);
}

}  // namespace

json number_gaps(const std::vector<int>& numbers) {
  json gaps = json::array();
  for (size_t i = 1; i < numbers.size(); ++i)
    if (numbers[i] > numbers[i - 1] + 1) gaps.push_back({numbers[i - 1] + 1, numbers[i] - 1});
  return gaps;
}

Recovery recover(const fs::path& folder) {
  if (trials_at(folder) != std::vector<fs::path>{folder})
    refuse(folder.string(), "found a folder of trials, expected one trial");
  const files::Lock lock(folder);
  if (!lock.held())
    refuse(folder.string(), "found a trial that is being recorded, expected one whose recorder has ended");
  Recovery recovery;
  mend_trial_json(folder, recovery);
  recovery.trial = trial::read_trial(folder);
  if (recovery.trial.state == trial::State::recording) {
    mend_recording(folder, recovery.trial.damaged);
    recovery.done.push_back("its recorder ended without finishing it: now cut");
    recovery.trial = trial::read_trial(folder);
  }
  recovery.mended = !recovery.done.empty();
  return recovery;
}

std::vector<fs::path> trials_at(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) refuse(folder.string(), "found no such folder, expected a trial or campaign");
  const auto is_trial = [&](const fs::path& at) {
    return fs::exists(at / "trial.json", error) || fs::exists(at / trial::copy_name, error);
  };
  if (is_trial(folder)) return {folder};
  std::vector<fs::path> trials;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_directory(error) && is_trial(entry.path())) trials.push_back(entry.path());
  if (trials.empty()) refuse(folder.string(), "found no trial, expected trial.json in it or in a folder below it");
  std::sort(trials.begin(), trials.end());
  return trials;
}

}  // namespace selvedge::capture
