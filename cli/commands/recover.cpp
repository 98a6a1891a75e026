// `./selvedge recover TRIAL`: mends what a recorder that was killed, a loss of power or a failing disk left of a trial,
// and says what was kept and what is a gap. Of a campaign's folder, each trial in it, whether campaign.json lists it or
// not.
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "capture/recovery.h"
#include "cli/command.h"
#include "files/bad_input.h"
#include "files/json_reader.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;

size_t rows(const std::vector<double>& times_s) { return times_s.size(); }

// Frame numbers that are missing, as trial.json lists them.
std::string gaps_in_numbers(const fs::path& folder) {
  const nlohmann::json about = files::JsonReader(folder / "trial.json").object();
  const nlohmann::json frames = about.value("frames", nlohmann::json::object());
  std::string text;
  for (const nlohmann::json& gap : frames.value("gaps", nlohmann::json::array()))
    text += fmt::format("{}{} to {}", text.empty() ? "" : ", ", gap.at(0).dump(), gap.at(1).dump());
  return text;
}

void print_recovery(const fs::path& folder, const capture::Recovery& recovery) {
  const trial::Trial& t = recovery.trial;
  fmt::print("{}: {}, {}\n", t.name, to_text(t.state), recovery.mended ? "mended" : "nothing to mend");
  for (const std::string& sentence : recovery.done) fmt::print("  {}\n", sentence);
  fmt::print("  kept: {} corner samples, {} frames, {} marker samples, {} arm samples\n", rows(t.corners.time_s),
             t.frames ? rows(t.frames->time_s) : 0, t.markers ? rows(t.markers->time_s) : 0,
             t.robot ? rows(t.robot->time_s) : 0);
  const std::string gaps = gaps_in_numbers(folder);
  if (!gaps.empty()) fmt::print("  gap: frames {}\n", gaps);
  for (const std::string& sentence : t.damaged) fmt::print("  gap: {}\n", sentence);
}

void recover(const fs::path& path) {
  const std::vector<fs::path> trials = capture::trials_at(path);
  std::vector<std::string> refused;
  for (const fs::path& folder : trials) {
    try {
      print_recovery(folder, capture::recover(folder));
    } catch (const BadInput& error) { refused.push_back(error.what()); }
  }
  if (refused.empty()) return;
  std::string text = refused.front();
  for (size_t i = 1; i < refused.size(); ++i) text += "; " + refused[i];
  throw BadInput(text);
}

}  // namespace

void add_recover(CLI::App& app, int&) {
  CLI::App* sub = app.add_subcommand(
      "recover",
      "mend a trial whose recorder was killed or whose disk lost something; say what was kept and what is a gap");
  auto path = std::make_shared<fs::path>();
  sub->add_option("TRIAL", *path, "folder of a trial, or of a campaign: each trial in it")->required();
  sub->callback([path] { recover(*path); });
}

}  // namespace selvedge::cli
