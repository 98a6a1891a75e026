// What a recorder that was killed left behind: recover and number_gaps of capture/recorder.h.
#include <set>

#include "capture/recorder.h"
#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/csv_table.h"
#include "files/json_reader.h"
#include "files/lock.h"
#include "files/whole_file.h"

namespace selvedge::capture {

namespace fs = std::filesystem;

namespace {

void cut_torn_line(const fs::path& path) {
  if (!fs::exists(path)) return;
  const std::string text = files::read_whole(path);
  const size_t whole = text.rfind('\n') + 1;  // npos + 1 is 0
  if (whole < text.size()) fs::resize_file(path, whole);
  if (whole == 0) fs::remove(path);
}

std::vector<int> listed_frames(const fs::path& folder) {
  std::vector<int> numbers;
  if (!fs::exists(folder / "frames.csv")) return numbers;
  const files::CsvTable table = files::read_csv(folder / "frames.csv", {{"frame"}});
  for (size_t row = 0; row < table.rows(); ++row) numbers.push_back(files::whole_number(table, row, 0, "frame"));
  return numbers;
}

void remove_unlisted_images(const fs::path& folder, const std::vector<int>& numbers) {
  if (!fs::exists(folder / "frames")) return;
  std::set<fs::path> listed;
  for (const int number : numbers) listed.insert(trial::frame_path(folder, number).filename());
  std::vector<fs::path> unlisted;
  for (const auto& entry : fs::directory_iterator(folder / "frames"))
    if (!listed.count(entry.path().filename())) unlisted.push_back(entry.path());
  for (const fs::path& path : unlisted) fs::remove(path);
  if (numbers.empty()) fs::remove(folder / "frames");
}

}  // namespace

nlohmann::json number_gaps(const std::vector<int>& numbers) {
  nlohmann::json gaps = nlohmann::json::array();
  for (size_t i = 1; i < numbers.size(); ++i)
    if (numbers[i] > numbers[i - 1] + 1) gaps.push_back({numbers[i - 1] + 1, numbers[i] - 1});
  return gaps;
}

bool recover(const fs::path& trial_folder) {
  const files::JsonReader reader(trial_folder / "trial.json");
  if (!reader.has("state") || reader.text("state") != to_text(trial::State::recording)) return false;
  const files::Lock lock(trial_folder);
  if (!lock.held()) refuse(trial_folder.string(), "found a trial that is being recorded, expected one whose recorder has ended");
  for (const char* name : {"corners.csv", "frames.csv", "markers.csv", "robot.csv"}) cut_torn_line(trial_folder / name);
  const std::vector<int> numbers = listed_frames(trial_folder);
  remove_unlisted_images(trial_folder, numbers);
  fs::remove(trial_folder / ".reserve");
  nlohmann::json value = files::read_json(trial_folder / "trial.json");
  value["state"] = to_text(trial::State::cut);
  value["cut_because"] = "the recorder ended without finishing the trial";
  value["frames"]["count"] = numbers.size();
  value["frames"]["gaps"] = number_gaps(numbers);
  files::write_json(trial_folder / "trial.json", value);
  return true;
}

}  // namespace selvedge::capture
