// ./selvedge experiment FILE --out DIR: one experiment of the paper of 2003 from its data file.
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "cli/command.h"
#include "cli/output_folder.h"
#include "experiments/experiment_report.h"
#include "report/progress.h"
#include "report/text_table.h"

namespace selvedge::cli {

namespace {

struct ExperimentArguments {
  std::filesystem::path file, out;
  std::vector<std::filesystem::path> campaigns;
  bool quick = false;
};

void run_experiment_file(const ExperimentArguments& a) {
  expect_folder("--out", a.out);
  experiments::ExperimentFile file = experiments::read_experiment(a.file);
  experiments::use_campaigns(file, a.campaigns);
  const experiments::ExperimentOutcome out = experiments::run_experiment(
      file, a.quick, a.out, report::terminal_progress("experiment " + a.file.stem().string()));
  for (const experiments::ResultTable& table : experiments::tables_of(out))
    fmt::print("{}\n{}\n", table.title, report::text_table(table.header, table.rows));
  for (const std::string& remark : experiments::remarks_of(out)) fmt::print("{}.\n", remark);
  experiments::write_experiment(out, a.out);
  fmt::print("wrote {} and {} in {:.0f} s\n", (a.out / "result.json").string(), (a.out / "report.html").string(),
             out.wall_s);
}

}  // namespace

void add_experiment(CLI::App& app, int&) {
  auto* command =
      app.add_subcommand("experiment", "an experiment of the paper of 2003 from its data file: its tables beside ours");
  auto a = std::make_shared<ExperimentArguments>();
  command->add_option("FILE", a->file, "the experiment (docs/experiments.md), such as examples/experiments/waving.toml")
      ->required();
  command
      ->add_option("--out", a->out, "folder for result.json and report.html; a run that was broken off continues in it")
      ->required();
  command
      ->add_option("--campaign", a->campaigns,
                   "recorded trials of one fabric, in place of the file's fabrics; once a fabric")
      ->type_name("DIR");
  command->add_flag("--quick", a->quick, "a coarse mesh, few frames and evaluations: shows that it runs");
  command->callback([a] { run_experiment_file(*a); });
}

}  // namespace selvedge::cli
