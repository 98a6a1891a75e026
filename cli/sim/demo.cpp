// ./selvedge demo: one automated capture-then-fit session against the simulated rig, from grid poses to a report,
// and at its end what was found against what the simulated fabric was.
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/spdlog.h>

#include "capture/trial/trial.h"
#include "cli/command.h"
#include "cli/output_folder.h"
#include "cli/shared_files.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "fit/fit_report.h"
#include "report/progress.h"
#include "report/verdict.h"
#include "rig/network.h"
#include "station/calibration_watch.h"
#include "station/demo_verdict.h"
#include "station/diagnosis_folder.h"
#include "station/file_steps.h"
#include "station/free_addresses.h"
#include "station/session_steps.h"
#include "station/simulated_motion.h"
#include "station/station_steps.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;

struct DemoArguments {
  std::string name;
  fs::path runs = "runs";
  fs::path rig = shared_folder() / "examples" / "demo-rig.toml";
  fs::path world = shared_folder() / "examples" / "demo-world.toml";
  int cells = fit::FitOptions().cells;
  bool diagnose = false;
};

// Shares of the whole time, for the time left: without a diagnosis, and with one.
constexpr double kCaptured = 0.55, kFitted = 0.5;

// A folder that was not there before.
fs::path make_folder(const DemoArguments& a) {
  expect_folder("--runs", a.runs);
  if (!a.name.empty()) {
    const fs::path folder = a.runs / a.name;
    if (fs::exists(folder)) refuse("--name " + a.name, "{} is there already", folder.string());
    fs::create_directories(folder);
    return folder;
  }
  fs::path folder = a.runs / "demo";
  for (int i = 2; fs::exists(folder); ++i) folder = a.runs / fmt::format("demo-{}", i);
  fs::create_directories(folder);
  return folder;
}

// Its trials lie in `folder` itself.
trial::Campaign capture(const station::SessionFile& file, station::Journal& journal, const fs::path& folder,
                        const report::ProgressCallback& progress) {
  station::StationSteps steps(file, journal, folder, shared_folder());
  station::run_steps(
      file, journal, steps, [](const std::string&) { return station::Answer::stop; },
      [&](double done, const std::string& what) { progress(kCaptured * done, what); });
  steps.prepare({"fit", 0, "", 0, 0});
  return trial::read_campaign(folder);
}

fit::FitOutcome fit_run(const DemoArguments& a, const trial::Campaign& campaign, const fs::path& folder,
                        const report::ProgressCallback& progress) {
  fit::FitOptions options;
  options.cells = a.cells;
  options.progress = [&](double done, const std::string& what) {
    progress(kCaptured + (1 - kCaptured) * done, "fitting: " + what);
  };
  fit::FitOutcome outcome = fit::fit_campaign(campaign, options);
  fit::write_fit(outcome, campaign, folder);
  station::write_simulated_motions(outcome, campaign, folder);
  return outcome;
}

// Beginning from its fit, as a session's.
void diagnose_run(station::SessionFile file, const fs::path& folder, const report::ProgressCallback& progress) {
  file.fit = true;
  const nlohmann::json told = station::run_on_files(
      file, {"diagnose", 0, "", 0, 0}, folder,
      [&](double done, const std::string& what) { progress(kFitted + (1 - kFitted) * done, "diagnosing: " + what); });
  const fs::path diagnosis = folder / station::diagnosis_folder_name(0);
  fmt::print("\ndiagnosis: {} (probability {:.2f})\n", told["cause"].get<std::string>(),
             told["probability"].get<double>());
  if (const auto verdict =
          report::read_verdict(files::read_json(diagnosis / "diagnosis.json").value("verdict", nlohmann::json())))
    fmt::print("{}\n", report::for_terminal(*verdict));
  fmt::print("see {}\n", (diagnosis / "report.html").string());
}

void print_session(const station::SessionFile& file, const station::Journal& journal,
                   const station::CalibrationWatch& watch) {
  for (const station::Step& step : station::planned_steps(file)) {
    const nlohmann::json found = journal.record(step.id(file)).result;
    const auto text = [&](const char* key) {
      return found[key].is_null() ? "?" : fmt::format("{:.2f}", found[key].get<double>());
    };
    if (step.kind == "calibrate")
      fmt::print("calibration {}: expected error at the fabric {} px camera, {} px projector, {} mm triangulated\n",
                 found["verdict"].get<std::string>(), text("camera_sd_px"), text("projector_sd_px"),
                 text("triangulation_sd_mm"));
    else
      fmt::print("{:<10} {} frames, {} lost, {} corner samples{}{}\n", step.trial, found["frames"].get<size_t>(),
                 found["frames_lost"].get<size_t>(), found["samples"].get<size_t>(),
                 found["started_at_rest"] ? "" : ", not at rest at its start",
                 found["attempts"] > 1 ? fmt::format(", attempt {}", found["attempts"].get<int>()) : "");
  }
  fmt::print("{}\n{}\n", watch.camera.sentence, watch.projector.sentence);
}

int run_demo(const DemoArguments& a) {
  rig::ensure_local_multicast(static_cast<uint16_t>(station::free_bus_port()));
  const auto begin = std::chrono::steady_clock::now();
  const fs::path folder = make_folder(a);
  fs::create_directories(folder / "logs");
  spdlog::set_default_logger(spdlog::basic_logger_mt("session", (folder / "logs" / "session.log").string()));
  spdlog::flush_on(spdlog::level::info);
  const report::ProgressCallback whole = report::terminal_progress("demo");
  const report::ProgressCallback progress = [&](double done, const std::string& what) {
    whole(a.diagnose ? kFitted * done : done, what);
  };
  const station::SessionFile file = station::session_of_rig(a.rig, a.world);
  station::Journal journal(folder, file.text);
  const trial::Campaign campaign = capture(file, journal, folder, progress);
  const station::CalibrationWatch watch = station::watch_calibration(campaign, [](double, const std::string&) {});
  station::write_watch(watch, folder);
  const fit::FitOutcome outcome = fit_run(a, campaign, folder, progress);
  // Only now is what the simulated fabric was read, to be compared with.
  const station::DemoVerdict verdict = station::judge(outcome, files::read_json(folder / "truth.json"));
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  print_session(file, journal, watch);
  fmt::print("{}", station::to_text(verdict));
  fmt::print("{:.0f} s; see {}\n", wall_s, (folder / "report.html").string());
  if (a.diagnose) diagnose_run(file, folder, whole);
  return verdict.parameters_hold() && verdict.held_out_holds() ? 0 : 1;
}

}  // namespace

void add_demo(CLI::App& app, int& exit_status) {
  auto* command = app.add_subcommand(
      "demo", "capture and fit a fabric on the simulated rig; exit 1 where the fit falls outside its bounds");
  auto a = std::make_shared<DemoArguments>();
  command->add_option("--name", a->name,
                      "folder below --runs for everything that is recorded and found; default: demo, demo-2 …");
  command->add_option("--runs", a->runs, "where that folder is made")->capture_default_str();
  command->add_option("--rig", a->rig, "the rig and its session (TOML)")->capture_default_str();
  command->add_option("--world", a->world, "what the simulated devices are like (TOML)")->capture_default_str();
  command
      ->add_option("--cells", a->cells,
                   "of the fit's sheet along the width (6 to 64); by default as many as the fabric asks for")
      ->check(CLI::Range(6, 64));
  command->add_flag("--diagnose", a->diagnose,
                    "diagnose it as well, some minutes more: what the fitted simulation lacks of the recorded fabric");
  command->callback([a, &exit_status] { exit_status = run_demo(*a); });
}

}  // namespace selvedge::cli
