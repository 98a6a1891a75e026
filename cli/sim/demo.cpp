// ./selvedge demo: one automated capture-then-fit session against the simulated rig, from grid poses to a report,
// and at its end what was found against what the simulated fabric was.
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>
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
#include "rig/network.h"
#include "station/automated_session.h"
#include "station/demo_verdict.h"
#include "station/free_addresses.h"
#include "station/simulated_rig.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;

struct DemoArguments {
  std::string name;
  fs::path runs = "runs";
  fs::path rig = shared_folder() / "examples" / "demo-rig.toml";
  fs::path world = shared_folder() / "examples" / "demo-world.toml";
  int columns = fit::FitOptions().columns;
};

// Shares of the whole time, for the time left.
constexpr double kCaptured = 0.55;

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

station::SessionResult capture(const DemoArguments& a, const fs::path& folder,
                               const report::ProgressCallback& progress) {
  station::SimulatedRig rig({a.rig, a.world, shared_folder() / "data" / "arms"}, folder);
  return station::run_session(rig.configuration(), folder, [&](double done, const std::string& what) {
    rig.require_running();
    progress(kCaptured * done, what);
  });
}

fit::FitOutcome fit_run(const DemoArguments& a, const fs::path& folder, const report::ProgressCallback& progress) {
  const trial::Campaign campaign = trial::read_campaign(folder);
  fit::FitOptions options;
  options.columns = a.columns;
  options.progress = [&](double done, const std::string& what) {
    progress(kCaptured + (1 - kCaptured) * done, "fitting: " + what);
  };
  fit::FitOutcome outcome = fit::fit_campaign(campaign, options);
  fit::write_fit(outcome, campaign, folder);
  return outcome;
}

void print_session(const station::SessionResult& session) {
  const calib::Calibration& c = session.calibration;
  fmt::print(
      "calibration {}: expected error at the fabric {:.2f} px camera, {:.2f} px projector, {:.2f} mm triangulated\n",
      calib::to_text(c.verdict), c.camera.deviation.mean_sd_px, c.projector->deviation.mean_sd_px,
      c.triangulation_sd_mm);
  for (const session::TrialRecord& trial : session.trials)
    fmt::print("{:<10} {} frames, {} lost, {} corner samples{}{}\n", trial.folder.filename().string(), trial.frames,
               trial.frames_lost, trial.samples, trial.started_at_rest ? "" : ", not at rest at its start",
               trial.attempts > 1 ? fmt::format(", attempt {}", trial.attempts) : "");
  fmt::print("{}\n{}\n", session.watch.camera.sentence, session.watch.projector.sentence);
}

int run_demo(const DemoArguments& a) {
  rig::ensure_local_multicast(static_cast<uint16_t>(station::free_bus_port()));
  const auto begin = std::chrono::steady_clock::now();
  const fs::path folder = make_folder(a);
  fs::create_directories(folder / "logs");
  spdlog::set_default_logger(spdlog::basic_logger_mt("session", (folder / "logs" / "session.log").string()));
  spdlog::flush_on(spdlog::level::info);
  const report::ProgressCallback progress = report::terminal_progress("demo");
  const station::SessionResult session = capture(a, folder, progress);
  const fit::FitOutcome outcome = fit_run(a, folder, progress);
  // Only now is what the simulated fabric was read, to be compared with.
  const station::DemoVerdict verdict = station::judge(outcome, files::read_json(folder / "truth.json"));
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  print_session(session);
  fmt::print("{}", station::to_text(verdict));
  fmt::print("{:.0f} s; see {}\n", wall_s, (folder / "report.html").string());
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
  command->add_option("--columns", a->columns, "mesh vertices along the width in the fit")
      ->check(CLI::Range(9, 65))
      ->capture_default_str();
  command->callback([a, &exit_status] { exit_status = run_demo(*a); });
}

}  // namespace selvedge::cli
