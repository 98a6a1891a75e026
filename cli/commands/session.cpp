// ./selvedge session run FILE [--out DIR]: several fabrics captured, fitted and diagnosed unattended; goes on where it
// was where DIR holds a session that was broken off.
#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/spdlog.h>

#include "cli/command.h"
#include "cli/output_folder.h"
#include "cli/slurm_options.h"
#include "files/shared_files.h"
#include "report/progress.h"
#include "rig/network.h"
#include "station/free_addresses.h"
#include "station/session_report.h"
#include "station/slurm_steps.h"
#include "station/station_steps.h"

namespace selvedge::cli {

namespace {

struct SessionArguments {
  std::filesystem::path file, out;
  std::string step;  // that one alone; empty: all
  station::SlurmOptions slurm;
};

void log_to(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "logs");
  spdlog::set_default_logger(spdlog::basic_logger_mt("session", (folder / "logs" / "session.log").string()));
  spdlog::flush_on(spdlog::level::info);
}

int run_session(const SessionArguments& a) {
  const std::filesystem::path folder = a.out.empty() ? std::filesystem::path("runs") / a.file.stem() : a.out;
  expect_folder("--out", folder);
  if (!a.step.empty()) return station::run_array_task(station::read_session_file(a.file), folder, a.step);
  rig::ensure_local_multicast(static_cast<uint16_t>(station::free_bus_port()));
  const station::SessionFile file = station::read_session_file(a.file);
  station::Journal journal(folder, file.text);
  log_to(folder);
  station::StationSteps steps(file, journal, folder, files::shared_folder());
  station::SlurmSteps by_array(steps, file, journal, folder, a.slurm);
  station::SessionSteps& used = a.slurm.used ? static_cast<station::SessionSteps&>(by_array) : steps;
  int status = 0;
  try {
    station::run_steps(
        file, journal, used, [&](const std::string& question) { return steps.ask(question); },
        report::terminal_progress("session " + a.file.stem().string()));
  } catch (const station::SessionStopped& stopped) {
    fmt::print(stderr, "stopped: {}\nrun the same command again to go on from there\n", stopped.what());
    status = 1;
  }
  const nlohmann::json summary = station::write_session_report(file, folder);
  fmt::print("{}see {}\n", station::session_text(summary), (folder / "report.html").string());
  for (const nlohmann::json& step : summary["steps"])
    if (step["state"] == "skipped") status = 1;
  return status;
}

}  // namespace

void add_session(CLI::App& app, int& exit_status) {
  auto* command = app.add_subcommand("session", "several fabrics in a row, unattended, from one file");
  command->require_subcommand(1);
  auto a = std::make_shared<SessionArguments>();
  auto* run = command->add_subcommand("run",
                                      "capture, fit and diagnose what FILE lists; goes on where a broken-off run was; "
                                      "exit 1 where a step was given up");
  run->add_option("FILE", a->file, "the session (TOML), see examples/four-fabrics.toml")->required();
  run->add_option("--out", a->out, "folder for everything that is recorded and found; default: runs/ and FILE's name");
  auto* step =
      run->add_option("--step", a->step, "one fit or diagnosis alone, as a task of a job array does")->type_name("ID");
  add_slurm_options(*run, a->slurm);
  run->get_option("--slurm")->excludes(step);
  run->callback([a, &exit_status] { exit_status = run_session(*a); });
}

}  // namespace selvedge::cli
