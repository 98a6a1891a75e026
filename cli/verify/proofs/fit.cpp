// `./selvedge prove fit`: tables 1, 2 and 3 and figure 14 of Bhat et al. 2003 on four simulated fabrics, and annealing
// beside least squares over both waving trials at once. Fabrics, trials and the paper's cells come from
// examples/experiments.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/verify/figures.h"
#include "experiments/experiment_report.h"
#include "experiments/simulated_trials.h"
#include "files/shared_files.h"
#include "report/text_table.h"

namespace selvedge::cli {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using experiments::FabricCase;
using experiments::FabricOutcome;
using experiments::Identification;
using experiments::IdentificationOptions;

constexpr double kDeterminedSd = 0.02;  // of the logarithm: a parameter counts as determined below it
constexpr double kUnseen = 1e6;         // %, printed for a variability without end
const experiments::KeptFits kNotKept{{}};

struct FitEffort {
  int static_evaluations = 60, waving_evaluations = 120, head_to_head_evaluations = 600, repeats = 5;
  std::vector<std::string> head_to_head = {"satin", "knit"};  // whose annealing has the paper's evaluations
};

// Static and waving trials of each fabric in one recording.
struct FitBench {
  experiments::ExperimentFile static_file, waving_file;
  std::vector<std::shared_ptr<const FabricCase>> cases;
};

void print_result(const experiments::ResultTable& table) {
  fmt::print("{}\n{}\n", table.title, report::text_table(table.header, table.rows));
}

FabricOutcome outcome_of(const std::shared_ptr<const FabricCase>& c, trial::Experiment kind) {
  FabricOutcome f;
  f.fabric = c;
  f.fitted = experiments::trials_of(*c, kind);
  f.searched = kind == trial::Experiment::static_hang ? 6 : 9;
  return f;
}

IdentificationOptions annealing_of(int evaluations, unsigned seed) {
  IdentificationOptions options;
  options.evaluations = evaluations;
  options.seed = seed;
  return options;
}

FitBench prepare_bench(const FigureOptions& options) {
  const std::filesystem::path files = files::shared_folder() / "examples" / "experiments";
  FitBench bench{
      experiments::read_experiment(files / "static.toml"), experiments::read_experiment(files / "waving.toml"), {}};
  experiments::TrialProtocol protocol = bench.waving_file.protocol;
  protocol.trials.insert(protocol.trials.begin(), bench.static_file.protocol.trials.begin(),
                         bench.static_file.protocol.trials.end());
  experiments::FitPlan plan;
  protocol.seed = options.seed;
  protocol.cells = plan.cells = options.quick ? 5 : 10;
  plan.coarse_cells = options.quick ? 5 : 8;
  protocol.frames = plan.frames = options.quick ? 9 : 18;
  protocol.frame_rate_hz = plan.frame_rate_hz = 15;
  std::vector<experiments::Fabric> fabrics = bench.waving_file.fabrics;
  if (options.quick) fabrics = {fabrics.front(), fabrics.back()};
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() /
      fmt::format("selvedge_prove_fit_{}", std::chrono::steady_clock::now().time_since_epoch().count());
  for (const experiments::Fabric& f : fabrics) {
    const trial::Campaign campaign = experiments::record_fabric(f, protocol, folder / f.name);
    bench.cases.push_back(experiments::prepare_case(f, campaign, experiments::Kind::cross, plan));
    options.progress(0.2 * static_cast<double>(bench.cases.size()) / static_cast<double>(fabrics.size()),
                     "recorded and started " + f.name);
  }
  std::filesystem::remove_all(folder);
  return bench;
}

// Table 1: six parameters of the static trials, drag left where it is. Damping must come out as undetermined.
void static_tables(const FitBench& bench, const FitEffort& effort, const FigureOptions& options,
                   std::vector<Figure>& figures) {
  double worst_rise = 0, least_damping = kUnseen;
  for (const auto& c : bench.cases) {
    FabricOutcome f = outcome_of(c, trial::Experiment::static_hang);
    const Identification found = experiments::identify(*c, f.fitted, f.searched,
                                                       annealing_of(effort.static_evaluations, options.seed), kNotKept);
    print_result(
        experiments::parameter_table("Table 1, static trials, " + c->fabric.name, f, found, bench.static_file.paper));
    for (Index t = 0; t < 2; ++t) worst_rise = std::max(worst_rise, found.error(t + 1, t) / found.error(0, t));
    for (size_t k = 3; k < 6; ++k) least_damping = std::min({least_damping, found.variability[k], kUnseen});
    options.progress(0.35, "static trials of " + c->fabric.name);
  }
  figures.push_back({"table 1: E after annealing over E at the start, worst of the trials", worst_rise, 1, "",
                     Relation::at_most, ""});
  figures.push_back({"table 1: least variability of a damping in static trials, so undetermined", least_damping, 100,
                     "%", Relation::at_least, "the paper: > 100 %"});
}

// Table 2: annealings of one static trial from starts within ±5 %.
void repeated_table(const FitBench& bench, const FitEffort& effort, const FigureOptions& options) {
  const FabricOutcome f = outcome_of(bench.cases[bench.cases.size() / 2], trial::Experiment::static_hang);
  const experiments::Repeats repeats =
      experiments::repeat(*f.fabric, f.fitted.front(), f.searched, effort.repeats,
                          annealing_of(effort.static_evaluations, options.seed), kNotKept);
  print_result(experiments::repeats_table("Table 2, static trial 1, starts within 5 %, " + f.fabric->fabric.name, f,
                                          repeats, bench.static_file.paper));
}

// Figure 14: recordings that their own fabric's parameters explain best.
double own_wins_of(const std::vector<FabricOutcome>& fabrics, size_t optimiser, const std::string& title) {
  const MatrixXd matrix = experiments::cross_errors(fabrics, optimiser);
  print_result(experiments::cross_table("Figure 14, E1+E2 of the waving trials, " + title, fabrics, matrix));
  return experiments::own_wins(matrix);
}

struct DeterminedOnes {
  int count = 0;
  double worst_off_percent = 0;
};

void print_least_squares(const FabricOutcome& f, const Identification& squares, const Identification& annealed,
                         DeterminedOnes& determined) {
  const FabricCase& c = *f.fabric;
  const experiments::OneFit& fit = squares.fits.front();
  std::vector<std::vector<std::string>> rows;
  for (Index k = 0; k < f.searched; ++k) {
    const model::Parameter& p = c.parameters[static_cast<size_t>(k)];
    const double off = 100 * std::expm1(fit.set(k) - (*c.truth)(k)), sd = fit.sd(k);
    const bool known = sd < kDeterminedSd;
    rows.push_back({p.name, fmt::format("{:.4g}", model::to_value(p, fit.set(k))),
                    fmt::format("{:.4g}", model::to_value(p, (*c.truth)(k))), fmt::format("{:+.1f}", off),
                    fmt::format("{:.1f}", std::min(100 * sd, kUnseen)), known ? "determined" : ""});
    if (!known) continue;
    determined.worst_off_percent = std::max(determined.worst_off_percent, std::abs(off));
    ++determined.count;
  }
  int evaluations = 0;
  for (const experiments::OneFit& one : annealed.fits) evaluations += one.evaluations;
  fmt::print(
      "Least squares over both waving trials, {}: E1+E2 {:.4g} in {:.1f} s and {} simulations; annealing {:.4g} in "
      "{:.1f} s and {}\n{}\n",
      c.fabric.name, squares.chosen_error(), squares.wall_s(), fit.evaluations, annealed.chosen_error(),
      annealed.wall_s(), evaluations, report::text_table({"", "fitted", "true", "off %", "sd %", ""}, rows));
}

// Table 3 and, on the same trials, least squares over both at once.
void waving_tables(const FitBench& bench, const FitEffort& effort, const FigureOptions& options,
                   std::vector<Figure>& figures) {
  std::vector<FabricOutcome> fabrics;
  double worst_error = 0, worst_wall = 0;
  DeterminedOnes determined;
  for (const auto& c : bench.cases) {
    const bool head_to_head =
        std::find(effort.head_to_head.begin(), effort.head_to_head.end(), c->fabric.name) != effort.head_to_head.end();
    FabricOutcome f = outcome_of(c, trial::Experiment::waving);
    IdentificationOptions how =
        annealing_of(head_to_head ? effort.head_to_head_evaluations : effort.waving_evaluations, options.seed);
    f.identified.push_back(experiments::identify(*c, f.fitted, f.searched, how, kNotKept));
    how.optimiser = "least_squares";
    f.identified.push_back(experiments::identify(*c, f.fitted, f.searched, how, kNotKept));
    const Identification &annealed = f.identified[0], &squares = f.identified[1];
    print_result(experiments::parameter_table("Table 3, waving trials, " + c->fabric.name, f, annealed,
                                              bench.waving_file.paper));
    print_least_squares(f, squares, annealed, determined);
    worst_error = std::max(worst_error, squares.chosen_error() / annealed.chosen_error());
    if (head_to_head) worst_wall = std::max(worst_wall, squares.wall_s() / annealed.wall_s());
    fabrics.push_back(std::move(f));
    options.progress(0.9, "waving trials of " + c->fabric.name);
  }
  const Relation judged = options.quick ? Relation::shown : Relation::at_most;
  figures.push_back({"waving: E1+E2 of least squares over annealing's, worst fabric", worst_error, 1, "", judged,
                     "required: no higher"});
  figures.push_back(
      {fmt::format("waving: wall time of least squares over annealing's {} evaluations a trial, worst of {}",
                   effort.head_to_head_evaluations, fmt::join(effort.head_to_head, ", ")),
       worst_wall, 0.1, "", judged, "required"});
  figures.push_back(
      {fmt::format("waving: farthest of {} determined parameters (sd below 2 %) from truth", determined.count),
       determined.worst_off_percent, 5, "%", judged, "required"});
  const double count = static_cast<double>(fabrics.size());
  const std::string of = fmt::format("of {}", fabrics.size());
  figures.push_back({"figure 14: fabrics whose own least-squares parameters win",
                     own_wins_of(fabrics, 1, "least squares"), count, of, Relation::at_least, "the paper: all"});
  figures.push_back({"figure 14: fabrics whose own annealed parameters win", own_wins_of(fabrics, 0, "annealing"),
                     count, of, options.quick ? Relation::shown : Relation::at_least, "the paper: all"});
}

}  // namespace

std::vector<Figure> prove_fit(const FigureOptions& options) {
  FitEffort effort;
  if (options.quick) effort = {10, 10, 10, 2, {"knit"}};
  const FitBench bench = prepare_bench(options);
  std::vector<Figure> figures;
  static_tables(bench, effort, options, figures);
  repeated_table(bench, effort, options);
  waving_tables(bench, effort, options, figures);
  return figures;
}

}  // namespace selvedge::cli
