// ./selvedge simulator check COMMAND: what is wrong with a simulator; serve: our own sheet as one.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <unistd.h>

#include "cli/command.h"
#include "files/bad_input.h"
#include "station/simulator/check.h"
#include "station/simulator/serve.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;
using Kind = station::SimulatorFinding::Kind;

struct SimulatorArguments {
  std::string command, base = "nonlinear_drag";
  station::SimulatorCheckOptions check;
  station::ServeOptions serve;
};

void run_check(SimulatorArguments& a, int& exit_status) {
  if (a.check.log.empty())
    a.check.log = fs::temp_directory_path() / fmt::format("selvedge-simulator-{}.log", ::getpid());
  a.check.tell = [](const station::SimulatorFinding& finding) {
    fmt::print("{:<7} {}\n",
               finding.kind == Kind::good    ? "ok"
               : finding.kind == Kind::wrong ? "wrong"
                                             : "note",
               printable(finding.text));
    std::fflush(stdout);
  };
  const auto findings = station::check_simulator(a.command, a.check);
  const auto wrong =
      std::count_if(findings.begin(), findings.end(), [](const auto& f) { return f.kind == Kind::wrong; });
  std::error_code ignored;
  if (fs::file_size(a.check.log, ignored) == 0) fs::remove(a.check.log, ignored);
  else fmt::print("what it wrote to its standard error is in {}\n", a.check.log.string());
  if (wrong > 0) fmt::print("{} of {} findings are wrong\n", wrong, findings.size());
  exit_status = wrong > 0 ? 2 : 0;
}

}  // namespace

void add_simulator(CLI::App& app, int& exit_status) {
  auto* simulator = app.add_subcommand("simulator", "another simulator as the base of a fit: try it; our own as one");
  simulator->require_subcommand(1);
  auto a = std::make_shared<SimulatorArguments>();
  auto* check = simulator->add_subcommand("check", "start a simulator, ask it small cases, say what is wrong with it");
  check->add_option("COMMAND", a->command, "a line for the shell; it speaks simulator/1 (docs/simulator.md)")
      ->required();
  check->add_option("--run-limit", a->check.run_limit_s, "of a run")
      ->check(CLI::PositiveNumber)
      ->type_name("SECONDS")
      ->capture_default_str();
  check->add_option("--log", a->check.log, "file for its standard error; by default one in the temporary folder");
  check->callback([a, &exit_status] { run_check(*a, exit_status); });
  auto* serve = simulator->add_subcommand("serve", "our own sheet on standard input and output, as simulator/1");
  serve->add_option("--base", a->base, "drag law")
      ->check(CLI::IsMember({"nonlinear_drag", "linear_drag", "no_drag"}))
      ->capture_default_str();
  serve->add_option("--cells", a->serve.cells, "along the width, for points that are not of a grid of splines")
      ->check(CLI::Range(4, 128))
      ->capture_default_str();
  serve->callback([a] {
    a->serve.drag = model::drag_named(a->base);
    station::serve_simulator(STDIN_FILENO, STDOUT_FILENO, a->serve);
  });
}

}  // namespace selvedge::cli
