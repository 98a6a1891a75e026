// `./selvedge prove fit`: tables 1, 2 and 3 and figure 14 of Bhat et al. 2003 on four simulated fabrics, and annealing beside
// least squares over both waving trials at once.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <random>

#include <fmt/format.h>

#include "cli/figures.h"
#include "cli/proofs/fabric_case.h"
#include "report/text_table.h"

namespace selvedge::cli {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Cases = std::vector<std::unique_ptr<FabricCase>>;
using Rows = std::vector<std::vector<std::string>>;

const std::vector<size_t> kStatic = {0, 1}, kWaving = {2, 3};
constexpr double kDeterminedSd = 0.02;  // of the logarithm: a parameter counts as determined below it
constexpr double kUnseen = 1e6;         // %, printed for a variability without end

struct FitEffort {
  int static_evaluations = 100, waving_evaluations = 120, head_to_head_evaluations = 600, repeats = 5;
};

std::string shown(double value) { return fmt::format("{:.4g}", value); }

// One experiment's two annealed sets, E1 and E2 of start and of both, and the set that the sum chooses.
struct AnnealedPair {
  TimedFit fits[2];
  MatrixXd energy;   // rows: start, set 1, set 2; columns: trial 1, trial 2
  int chosen = 0;
};

AnnealedPair anneal_pair(const FabricCase& c, const std::vector<size_t>& trials, Index searched, int evaluations, unsigned seed) {
  AnnealedPair pair;
  MatrixXd sets(c.start.size(), 3);
  sets.col(0) = c.start;
  for (int k = 0; k < 2; ++k) {
    pair.fits[k] = anneal_case(c, trials[static_cast<size_t>(k)], searched, c.start, evaluations, seed);
    sets.col(k + 1) = pair.fits[k].set;
  }
  pair.energy = energies(c, sets, trials);
  pair.chosen = pair.energy.row(1).sum() <= pair.energy.row(2).sum() ? 0 : 1;
  return pair;
}

double value_of(const FabricCase& c, Index k, const VectorXd& set) { return fit::to_value(c.parameters[static_cast<size_t>(k)], set(k)); }

void print_pair(const std::string& title, const FabricCase& c, const AnnealedPair& pair, Index searched, const std::vector<double>& variability) {
  Rows rows;
  for (Index k = 0; k < searched; ++k) {
    const double percent = variability[static_cast<size_t>(k)];
    rows.push_back({c.parameters[static_cast<size_t>(k)].name, shown(value_of(c, k, c.start)), shown(value_of(c, k, pair.fits[0].set)),
                    shown(value_of(c, k, pair.fits[1].set)), shown(value_of(c, k, c.true_coordinates)), percent > 100 ? ">100" : shown(percent)});
  }
  for (Index t = 0; t < 2; ++t)
    rows.push_back({fmt::format("E{}", t + 1), shown(pair.energy(0, t)), shown(pair.energy(1, t)), shown(pair.energy(2, t)), "", ""});
  rows.push_back({"E1+E2", shown(pair.energy.row(0).sum()), shown(pair.energy.row(1).sum()), shown(pair.energy.row(2).sum()), "", ""});
  fmt::print("{}, {} (parameters of experiment {} chosen)\n{}\n", title, c.truth.name, pair.chosen + 1,
             report::text_table({"", "start", "exp 1", "exp 2", "true", "variability %"}, rows));
}

// Table 1: six parameters of the static trials, drag left where it is. Damping must come out as undetermined.
void static_tables(const Cases& cases, const FitEffort& effort, const FigureOptions& options, std::vector<Figure>& figures) {
  double worst_rise = 0, least_damping = kUnseen;
  for (const auto& c : cases) {
    const AnnealedPair pair = anneal_pair(*c, kStatic, 6, effort.static_evaluations, options.seed);
    const std::vector<double> variability = case_variability(*c, kStatic, 6, pair.fits[pair.chosen].set);
    print_pair("Table 1, static trials", *c, pair, 6, variability);
    for (int t = 0; t < 2; ++t) worst_rise = std::max(worst_rise, pair.energy(t + 1, t) / pair.energy(0, t));
    for (size_t k = 3; k < 6; ++k) least_damping = std::min(least_damping, std::min(variability[k], kUnseen));
    options.progress(0.35, "static trials of " + c->truth.name);
  }
  figures.push_back({"table 1: E after annealing over E at the start, worst of the trials", worst_rise, 1, "", Relation::at_most, ""});
  figures.push_back({"table 1: least variability of a damping in static trials, so undetermined", least_damping, 100, "%", Relation::at_least, "the paper: > 100 %"});
}

// Table 2: annealings of one static trial from starts within ±5 %.
void repeated_table(const FabricCase& c, const FitEffort& effort, const FigureOptions& options) {
  std::mt19937_64 random(options.seed);
  std::uniform_real_distribution<double> within(-0.05, 0.05);
  Rows rows;
  for (int i = 0; i < effort.repeats; ++i) {
    VectorXd start = c.start;
    for (Index k = 0; k < 6; ++k) start(k) += std::log1p(within(random));
    const TimedFit found = anneal_case(c, 0, 6, start, effort.static_evaluations, options.seed + static_cast<unsigned>(i));
    std::vector<std::string> row = {fmt::format("optimisation {}", i + 1)};
    for (Index k = 0; k < 6; ++k) row.push_back(shown(value_of(c, k, found.set)));
    row.push_back(shown(energies(c, found.set, {0})(0, 0)));
    rows.push_back(std::move(row));
  }
  std::vector<std::string> header = {""};
  for (size_t k = 0; k < 6; ++k) header.push_back(c.parameters[k].name);
  header.push_back("E1");
  fmt::print("Table 2, {}, static trial 1, starts within 5 %\n{}\n", c.truth.name, report::text_table(header, rows));
}

// Figure 14: rows recordings, columns whose parameters were simulated.
MatrixXd cross_matrix(const Cases& cases, const std::vector<VectorXd>& sets, const std::string& title) {
  MatrixXd matrix(static_cast<Index>(cases.size()), static_cast<Index>(cases.size()));
  Rows rows;
  std::vector<std::string> header = {"recorded \\ simulated"};
  for (size_t i = 0; i < cases.size(); ++i) {
    header.push_back(cases[i]->truth.name);
    rows.push_back({cases[i]->truth.name});
    for (size_t j = 0; j < cases.size(); ++j) {
      matrix(static_cast<Index>(i), static_cast<Index>(j)) = energy_beside(*cases[i], *cases[j], sets[j], kWaving);
      rows.back().push_back(shown(matrix(static_cast<Index>(i), static_cast<Index>(j))));
    }
  }
  fmt::print("Figure 14, E1+E2 of the waving trials, {}\n{}\n", title, report::text_table(header, rows));
  return matrix;
}

double own_wins(const MatrixXd& matrix) {
  double wins = 0;
  for (Index i = 0; i < matrix.rows(); ++i) wins += matrix(i, i) <= matrix.row(i).minCoeff();
  return wins;
}

// Table 3 and, on the same trials, least squares over both at once.
void waving_tables(const Cases& cases, const FitEffort& effort, const FigureOptions& options, std::vector<Figure>& figures) {
  std::vector<VectorXd> annealed, modern;
  double worst_error = 0, worst_wall = 0, worst_off = 0;
  int determined = 0;
  for (const auto& c : cases) {
    const bool head_to_head = c == cases.back();
    const AnnealedPair pair = anneal_pair(*c, kWaving, 9, head_to_head ? effort.head_to_head_evaluations : effort.waving_evaluations, options.seed);
    print_pair("Table 3, waving trials", *c, pair, 9, case_variability(*c, kWaving, 9, pair.fits[pair.chosen].set));
    VectorXd sd;
    const TimedFit squares = least_squares_case(*c, kWaving, sd);
    const MatrixXd energy = energies(*c, squares.set, kWaving);
    const double wall = pair.fits[0].wall_s + pair.fits[1].wall_s, best = pair.energy.row(pair.chosen + 1).sum();
    Rows rows;
    for (Index k = 0; k < 9; ++k) {
      const double off = 100 * std::expm1(squares.set(k) - c->true_coordinates(k));
      const bool known = sd(k) < kDeterminedSd;
      rows.push_back({c->parameters[static_cast<size_t>(k)].name, shown(value_of(*c, k, squares.set)), shown(value_of(*c, k, c->true_coordinates)),
                      fmt::format("{:+.1f}", off), fmt::format("{:.1f}", std::min(100 * sd(k), kUnseen)), known ? "determined" : ""});
      if (known) worst_off = std::max(worst_off, std::abs(off));
      determined += known;
    }
    fmt::print("Least squares over both waving trials, {}: E1+E2 {:.4g} in {:.1f} s and {} simulations; annealing {:.4g} in {:.1f} s and {}\n{}\n", c->truth.name,
               energy.sum(), squares.wall_s, squares.evaluations, best, wall, pair.fits[0].evaluations + pair.fits[1].evaluations,
               report::text_table({"", "fitted", "true", "off %", "sd %", ""}, rows));
    worst_error = std::max(worst_error, energy.sum() / best);
    if (head_to_head) worst_wall = squares.wall_s / wall;
    annealed.push_back(pair.fits[pair.chosen].set);
    modern.push_back(squares.set);
    options.progress(0.9, "waving trials of " + c->truth.name);
  }
  const Relation judged = options.quick ? Relation::shown : Relation::at_most;
  figures.push_back({"waving: E1+E2 of least squares over annealing's, worst fabric", worst_error, 1, "", judged, "required: no higher"});
  figures.push_back({fmt::format("waving: wall time of least squares over annealing's {} evaluations a trial, {}", effort.head_to_head_evaluations, cases.back()->truth.name),
                     worst_wall, 0.1, "", judged, "required"});
  figures.push_back({fmt::format("waving: farthest of {} determined parameters (sd below 2 %) from truth", determined), worst_off, 5, "%", judged, "required"});
  const double count = static_cast<double>(cases.size());
  figures.push_back({"figure 14: fabrics whose own least-squares parameters win", own_wins(cross_matrix(cases, modern, "least squares")), count,
                     fmt::format("of {}", cases.size()), Relation::at_least, "the paper: all"});
  figures.push_back({"figure 14: fabrics whose own annealed parameters win", own_wins(cross_matrix(cases, annealed, "annealing")), count,
                     fmt::format("of {}", cases.size()), options.quick ? Relation::shown : Relation::at_least, "the paper: all"});
}

}  // namespace

std::vector<Figure> prove_fit(const FigureOptions& options) {
  FitEffort effort;
  CaseOptions case_options;
  case_options.seed = options.seed;
  std::vector<TrueFabric> fabrics = true_fabrics();
  if (options.quick) {
    effort = {12, 10, 12, 2};
    case_options.columns = case_options.coarse_columns = 7;
    case_options.frames = 9;
    fabrics = {fabrics.front(), fabrics.back()};
  }
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("selvedge_prove_fit_{}", std::chrono::steady_clock::now().time_since_epoch().count());
  Cases cases;
  for (const TrueFabric& fabric : fabrics) {
    cases.push_back(prepare_case(fabric, folder / fabric.name, case_options));
    options.progress(0.2 * static_cast<double>(cases.size()) / static_cast<double>(fabrics.size()), "recorded and started " + fabric.name);
  }
  std::filesystem::remove_all(folder);
  std::vector<Figure> figures;
  static_tables(cases, effort, options, figures);
  repeated_table(*cases[cases.size() / 2], effort, options);
  waving_tables(cases, effort, options, figures);
  return figures;
}

}  // namespace selvedge::cli
