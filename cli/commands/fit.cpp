// ./selvedge fit PATH --out DIR: fits a trial or campaign.
#include <filesystem>
#include <memory>
#include <string>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "capture/trial/trial.h"
#include "cli/command.h"
#include "cli/commands/fit_of_tests.h"
#include "cli/output_folder.h"
#include "files/bad_input.h"
#include "fit/campaign_search.h"
#include "fit/fit_campaign.h"
#include "fit/fit_report.h"
#include "fit/fit_text.h"
#include "fit/fit_verdict.h"
#include "material_tests/fabric_library.h"
#include "model/ranks/ranks.h"
#include "report/progress.h"
#include "station/simulated_motion.h"
#include "station/simulator/foreign_simulator.h"

namespace selvedge::cli {

namespace {

struct FitArguments {
  std::filesystem::path path, out, library;
  std::string like, simulator;
  double run_limit_s = 60;
  std::string base = "nonlinear_drag", hold_out = "automatic";
  std::string optimiser = "least_squares", error = "residuals";
  fit::CampaignSearch search;
  fit::FitOptions options;
};

// What only the searches use is not passed over in silence.
void refuse_what_least_squares_has_not(const CLI::App& command) {
  for (const char* name : {"--error", "--evaluations", "--seed", "--search"})
    if (command.count(name) > 0)
      refuse(name, "found it with --optimiser least_squares, expected it with annealing, evolution, cma or grid alone");
}

// Nor what our own sheet alone has.
void refuse_what_others_have_not(const CLI::App& command) {
  for (const char* name : {"--base", "--like"})
    if (command.count(name) > 0)
      refuse(name, "found it with --simulator, expected it without: parameters are the simulator's own");
}

// One rank of an MPI job speaks for all.
void fall_silent() {
  const int nowhere = ::open("/dev/null", O_WRONLY);
  ::dup2(nowhere, 1);
  ::dup2(nowhere, 2);
  ::close(nowhere);
}

void fit_and_write(FitArguments& a, const CLI::App& command, bool speaks) {
  if (a.optimiser == "least_squares") refuse_what_least_squares_has_not(command);
  if (!a.simulator.empty()) refuse_what_others_have_not(command);
  expect_folder("--out", a.out);
  const trial::Campaign campaign = trial::read_campaign(a.path), rig = trial::only_tests(campaign, false);
  for (const trial::Trial& t : campaign.trials)
    for (const std::string& sentence : t.damaged)
      fmt::print(stderr, "passed over as damaged: {}: {}\n", t.name, sentence);
  a.options.drag = model::drag_named(a.base);
  a.options.hold_out = fit::hold_out_named(a.hold_out);
  if (rig.trials.empty()) {
    if (!a.simulator.empty())
      refuse("--simulator", "found material tests alone, expected a fabric that hangs from a rig");
    if (speaks) fit_tests_and_write(campaign, a.library, a.out);
    return;
  }
  if (!a.like.empty()) {
    const std::filesystem::path folder = material_tests::library_folder(a.library);
    a.options.like = material_tests::fabric_named(material_tests::read_library(folder), a.like, folder);
  }
  if (speaks) a.options.progress = report::terminal_progress("fit " + campaign.folder.filename().string());
  a.options.journal = a.out / "iterations.txt";
  if (!a.simulator.empty()) {
    std::filesystem::create_directories(a.out);
    a.options.simulator = std::make_shared<station::ForeignSimulator>(
        a.simulator, station::ForeignOptions{a.out / "simulator.log", a.run_limit_s});
  }
  const bool searches = a.optimiser != "least_squares";
  if (searches) {
    a.search.optimiser = a.optimiser;
    a.search.error = a.error == "folds" ? fit::SearchError::folds : fit::SearchError::residuals;
    a.options = fit::with_search(a.options, a.search, rig, a.out);
  }
  fit::FitOutcome out = fit::fit_campaign(campaign, a.options);
  if (a.options.ranks) a.options.ranks->end();
  if (!speaks) return;
  out.optimiser = a.optimiser;
  for (const fit::FittedParameter& p : out.parameters)
    if (p.parameter.name == "bend" && !out.simulator)
      add_place(out.remarks, p.value, trial::areal_mass(rig.trials.front()), a.library);
  fit::write_fit(out, rig, a.out);
  station::write_simulated_motions(out, rig, a.out);
  std::filesystem::remove(a.options.journal);  // of a fit that ended, nothing is to be gone on with
  fmt::print("{}\n{}", report::for_terminal(fit::verdict_of(out)), fit::outcome_text(out));
  fmt::print("wrote {} and {}\n", (a.out / "fit.json").string(), (a.out / "report.html").string());
}

void run_fit(FitArguments& a, const CLI::App& command) {
  a.options.ranks = model::Ranks::join();
  if (!a.options.ranks || a.options.ranks->is_first()) return fit_and_write(a, command, true);
  fall_silent();
  try {
    fit_and_write(a, command, false);
  } catch (const std::exception& error) {
    a.options.ranks->give_up(error.what());
    throw;
  }
}

}  // namespace

void add_fit(CLI::App& app, int&) {
  auto* command = app.add_subcommand(
      "fit", "fit a trial or campaign: parameters with intervals, held-out error, report; of material tests too");
  auto a = std::make_shared<FitArguments>();
  command->add_option("PATH", a->path, "folder of a trial or campaign")->required();
  command->add_option("--out", a->out, "folder for fit.json and report.html")->required();
  command->add_option("--base", a->base, "drag law of the base model")
      ->check(CLI::IsMember({"nonlinear_drag", "linear_drag", "no_drag"}))
      ->capture_default_str();
  command
      ->add_option("--cells", a->options.cells,
                   "of the sheet of splines along the width (6 to 64); by default as many as the fabric asks for")
      ->check(CLI::Range(6, 64));
  command->add_option("--like", a->like, "a fabric of the library: rigidity begins there and is loosely drawn to it");
  command->add_option("--library", a->library,
                      "folder of measured fabrics; by default the user's own (./selvedge fabrics)");
  command
      ->add_option("--simulator", a->simulator,
                   "command of another simulator, which is fitted in the place of our sheet (docs/simulator.md)")
      ->type_name("COMMAND");
  command->add_option("--run-limit", a->run_limit_s, "of a run of that simulator")
      ->check(CLI::PositiveNumber)
      ->type_name("SECONDS")
      ->capture_default_str();
  command->add_option("--hold-out", a->hold_out, "what is held out")
      ->check(CLI::IsMember({"automatic", "frames", "trials"}))
      ->capture_default_str();
  command->add_option("--optimiser", a->optimiser, "what refines the start")
      ->check(CLI::IsMember({"least_squares", "annealing", "evolution", "cma", "grid"}))
      ->capture_default_str();
  command->add_option("--error", a->error, "what those minimise: robust residuals in mm, or the fold metric's E")
      ->check(CLI::IsMember({"residuals", "folds"}))
      ->capture_default_str();
  command->add_option("--evaluations", a->search.evaluations, "their budget")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--seed", a->search.seed, "of their random choices")->type_name("N")->capture_default_str();
  command->add_option("--search", a->search.parameters, "parameters they search, with commas between; all by default")
      ->delimiter(',')
      ->type_name("NAMES");
  command->callback([a, command] { run_fit(*a, *command); });
}

}  // namespace selvedge::cli
