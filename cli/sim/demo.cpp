// ./selvedge demo: one automated session against the simulated rig, from grid poses over fit and diagnosis to a second
// session that confirms it, and at its end what was found against what the simulated fabric was and had hidden.
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/spdlog.h>

#include "cli/command.h"
#include "cli/output_folder.h"
#include "files/bad_input.h"
#include "files/lock.h"
#include "files/shared_files.h"
#include "files/whole_file.h"
#include "report/progress.h"
#include "rig/network.h"
#include "station/confirmation.h"
#include "station/demo_verdict.h"
#include "station/free_addresses.h"
#include "station/session_steps.h"
#include "station/station_steps.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;

struct DemoArguments {
  std::string name;
  fs::path runs = "runs";
  fs::path rig = files::shared_folder() / "examples" / "demo-rig.toml";
  fs::path world = files::shared_folder() / "examples" / "demo-world.toml";
  int cells = 0;
};

constexpr const char* kEnd = "demo.json";  // of a run that is over

// The rig's own trials, fitted, diagnosed, and confirmed by a second session.
station::SessionFile session_of(const DemoArguments& a) {
  station::SessionFile file = station::session_of_rig(a.rig, a.world);
  file.fit = file.diagnosis = file.confirm = true;
  file.fit_cells = file.diagnosis_cells = a.cells;
  // What a run that goes on must have in common with how it began.
  file.text += fmt::format("# ./selvedge demo --cells {}\n", a.cells);
  return file;
}

// A run of this very session that was broken off, and that no process goes on with.
bool can_go_on(const fs::path& folder, const station::SessionFile& file) {
  for (const char* name : {"journal.jsonl", "session.toml", "swatches.toml"})
    if (!fs::exists(folder / name)) return false;
  return !fs::exists(folder / kEnd) && files::read_whole(folder / "session.toml") == file.text &&
         files::read_whole(folder / "swatches.toml") == file.simulated_world &&
         files::Lock(folder / "session.lock").held();
}

// A folder that was not there before, or that of a run that was broken off.
fs::path choose_folder(const DemoArguments& a, const station::SessionFile& file) {
  expect_folder("--runs", a.runs);
  fs::path folder = a.runs / (a.name.empty() ? "demo" : a.name);
  for (int i = 2; fs::exists(folder) && !can_go_on(folder, file); ++i) {
    if (!a.name.empty())
      refuse("--name " + a.name,
             "found {}, which is over, or another's; expected a new name, or a run of this rig and "
             "world that was broken off",
             folder.string());
    folder = a.runs / fmt::format("demo-{}", i);
  }
  if (fs::exists(folder)) fmt::print("goes on with {}\n", folder.string());
  return folder;
}

void print_session(const station::SessionFile& file, const station::Journal& journal, const fs::path& folder) {
  for (const station::Step& step : station::planned_steps(file)) {
    const nlohmann::json found = journal.record(step.id(file)).result;
    const auto text = [&](const char* key) {
      return found[key].is_null() ? "?" : fmt::format("{:.2f}", found[key].get<double>());
    };
    if (step.kind == "calibrate")
      fmt::print("calibration {}: expected error at the fabric {} px camera, {} px projector, {} mm triangulated\n",
                 found["verdict"].get<std::string>(), text("camera_sd_px"), text("projector_sd_px"),
                 text("triangulation_sd_mm"));
    if (step.kind == "record")
      fmt::print("{:<10} {} frames, {} lost, {} corner samples{}{}\n", step.trial, found["frames"].get<size_t>(),
                 found["frames_lost"].get<size_t>(), found["samples"].get<size_t>(),
                 found["started_at_rest"] ? "" : ", not at rest at its start",
                 found["attempts"] > 1 ? fmt::format(", attempt {}", found["attempts"].get<int>()) : "");
  }
  const nlohmann::json watch = files::read_json(folder / "calibration-watch.json");
  for (const char* device : {"camera", "projector"})
    fmt::print("{}\n", watch.at(device).at("sentence").get<std::string>());
}

// Only now is what the simulated fabric was, and what it had hidden, read, to be compared with.
int tell(const station::SessionFile& file, const station::Journal& journal, const fs::path& folder) {
  const station::DemoVerdict verdict = station::judge(station::read_demo_answers(folder));
  print_session(file, journal, folder);
  fmt::print("{}", station::to_text(verdict));
  files::write_json(folder / kEnd, station::to_json(verdict));
  return verdict.holds() ? 0 : 1;
}

int run_demo(const DemoArguments& a) {
  rig::ensure_local_multicast(static_cast<uint16_t>(station::free_bus_port()));
  const auto begin = std::chrono::steady_clock::now();
  const station::SessionFile file = session_of(a);
  const fs::path folder = choose_folder(a, file);
  fs::create_directories(folder / "logs");
  spdlog::set_default_logger(spdlog::basic_logger_mt("session", (folder / "logs" / "session.log").string()));
  spdlog::flush_on(spdlog::level::info);
  station::Journal journal(folder, file.text);
  station::StationSteps steps(file, journal, folder, files::shared_folder());
  try {
    station::run_steps(
        file, journal, steps, [](const std::string&) { return station::Answer::stop; },
        report::terminal_progress("demo"));
  } catch (const station::SessionStopped& stopped) {
    fmt::print(stderr, "stopped: {}\nrun the same command again to go on from there\n", stopped.what());
    return 1;
  }
  const int status = tell(file, journal, folder);
  const bool confirmed = fs::exists(folder / station::kConfirmationFolder / "report.html");
  fmt::print("{:.0f} s; see {}, its diagnosis/report.html{}\n",
             std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(),
             (folder / "report.html").string(), confirmed ? " and confirmation/report.html" : "");
  return status;
}

}  // namespace

void add_demo(CLI::App& app, int& exit_status) {
  auto* command =
      app.add_subcommand("demo",
                         "capture, fit and diagnose a fabric on the simulated rig, and confirm it in a second session; "
                         "exit 1 where the fit "
                         "falls outside its bounds or what is hidden is not found; goes on where a broken-off run was");
  auto a = std::make_shared<DemoArguments>();
  command->add_option("--name", a->name,
                      "folder below --runs for everything that is recorded and found; default: demo, demo-2 …");
  command->add_option("--runs", a->runs, "where that folder is made")->capture_default_str();
  command->add_option("--rig", a->rig, "the rig and its session (TOML)")->capture_default_str();
  command->add_option("--world", a->world, "what the simulated devices are like (TOML)")->capture_default_str();
  command
      ->add_option(
          "--cells", a->cells,
          "of the sheet of fit and diagnosis along the width (6 to 48); by default as many as the fabric asks for")
      ->check(CLI::Range(6, 48));
  command->callback([a, &exit_status] { exit_status = run_demo(*a); });
}

}  // namespace selvedge::cli
