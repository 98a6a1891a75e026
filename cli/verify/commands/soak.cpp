// ./selvedge soak --hours H --seed S: a simulated rig under injected faults; exit 1 where a written frame is lost,
// the arm moves after a stop, or a daemon ends by itself.
#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/spdlog.h>

#include "cli/command.h"
#include "cli/output_folder.h"
#include "cli/stop_signals.h"
#include "cli/verify/soak/recorder.h"
#include "cli/verify/soak/soak.h"
#include "files/bad_input.h"
#include "files/shared_files.h"
#include "files/whole_file.h"

namespace selvedge::cli {

namespace {

int run_soak(SoakOptions options, const std::filesystem::path& runs) {
  expect_folder("--runs", runs);
  options.folder = std::filesystem::absolute(runs / fmt::format("soak-{}", options.seed));
  for (int i = 2; std::filesystem::exists(options.folder); ++i)
    options.folder = std::filesystem::absolute(runs / fmt::format("soak-{}-{}", options.seed, i));
  std::filesystem::create_directories(options.folder / "logs");
  spdlog::set_default_logger(spdlog::basic_logger_mt("soak", (options.folder / "logs" / "soak.log").string()));
  options.progress = report::terminal_progress("soak");
  const SoakResult result = soak(options, stop_on_signals());
  files::write_json(options.folder / "soak.json", to_json(result, options.seed));
  fmt::print("{}see {}\n", to_text(result), (options.folder / "soak.json").string());
  return result.holds() ? 0 : 1;
}

}  // namespace

void add_soak(CLI::App& app, int& exit_status) {
  auto* command = app.add_subcommand(
      "soak", "run a simulated rig under faults; exit 1 where a written frame is lost or the arm moves after a stop");
  auto options = std::make_shared<SoakOptions>();
  const std::filesystem::path source = files::shared_folder();
  options->rig = source / "data" / "soak" / "rig.toml";
  options->world = source / "data" / "soak" / "world.toml";
  options->arms = source / "data" / "arms";
  auto runs = std::make_shared<std::filesystem::path>("runs");
  command->add_option("--hours", options->hours, "how long faults are injected")
      ->check(CLI::Range(0.003, 1000.0))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "of the faults")->capture_default_str();
  command->add_option("--runs", *runs, "where the run's folder is made: soak-SEED, with soak.json and logs")
      ->capture_default_str();
  command->callback([options, runs, &exit_status] { exit_status = run_soak(*options, *runs); });

  // What the soak starts, kills and starts again.
  auto* recorder = app.add_subcommand("soak-recorder", "record trials on a running rig until ended")->group("");
  struct Places {
    std::filesystem::path rig, world, trials;
  };
  auto places = std::make_shared<Places>();
  recorder->add_option("--config", places->rig, "the rig's configuration file (TOML)")->required();
  recorder->add_option("--world", places->world, "the simulated world's file (TOML)")->required();
  recorder->add_option("--trials", places->trials, "where trials are recorded")->required();
  recorder->callback([places] { record_trials(places->rig, places->world, places->trials, stop_on_signals()); });
}

}  // namespace selvedge::cli
