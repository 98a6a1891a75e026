// `./selvedge prove simulator`: our own sheet behind simulator/1 gives the fit that it gives in this process, on the
// same grid.
#include <cmath>

#include <fmt/format.h>
#include <unistd.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/simulator_behind.h"
#include "diagnose/diagnosis.h"
#include "fit/fit_campaign.h"

namespace selvedge::cli {

namespace {

// How far one fit lies from another of the same parameters.
struct FitsApart {
  double determined_percent = 0, of_interval_percent = 0, error_mm = 0;
};

FitsApart apart(const fit::FitOutcome& a, const fit::FitOutcome& b) {
  FitsApart out;
  for (size_t k = 0; k < a.parameters.size(); ++k) {
    const fit::FittedParameter &p = a.parameters[k], &q = b.parameters[k];
    const double half = 0.5 * (p.upper_interval - p.lower_interval);
    out.of_interval_percent = std::max(out.of_interval_percent, 100 * std::abs(q.value - p.value) / half);
    if (p.determined) out.determined_percent = std::max(out.determined_percent, 100 * std::abs(q.value / p.value - 1));
  }
  for (size_t i = 0; i < a.trials.size(); ++i)
    out.error_mm = std::max(out.error_mm, std::abs(a.trials[i].end_mm - b.trials[i].end_mm));
  return out;
}

// Furthest apart at the same parameters, from the same branches.
double residuals_apart_mm(const fit::FitOutcome& here, const std::shared_ptr<const model::Simulator>& behind) {
  model::SimulationOptions options = here.simulation->options();
  options.simulator = behind;
  const model::Simulation there(here.simulation->trials(), options);
  const model::Residuals a = here.simulation->evaluate(here.state, here.simulator->parameters(), here.coordinates)[0];
  const model::Residuals b = there.evaluate(here.state, behind->parameters(), here.coordinates)[0];
  double most = 0;
  for (size_t i = 0; i < a.mm.size(); ++i) most = std::max(most, (a.mm[i] - b.mm[i]).cwiseAbs().maxCoeff());
  return most;
}

// What a diagnosis says that our sheet lacks where it comes without drag, or with it, behind simulator/1.
diagnose::SimulatorGap lacks(const trial::Campaign& campaign, int cells, model::Drag drag,
                             const std::filesystem::path& log) {
  const auto simulator = own_sheet_behind(log, drag);
  diagnose::DiagnosisOptions options;
  options.study.protocol.cells = cells;
  options.other =
      diagnose::FittedSimulator{simulator, fit::fit_campaign(campaign, fit_behind(cells, simulator)).coordinates};
  return diagnose::diagnose(campaign, {}, options).other;
}

void add_what_it_lacks(std::vector<Figure>& figures, const trial::Campaign& campaign, int cells,
                       const std::filesystem::path& log) {
  const diagnose::SimulatorGap none = lacks(campaign, cells, model::Drag::none, log),
                               own = lacks(campaign, cells, model::Drag::nonlinear, log);
  double no_drag = 0;
  for (const diagnose::SimulatorPart& p : none.parts)
    if (p.name == "no drag") no_drag = p.share.value;
  const std::string without = "our sheet without drag, diagnosed behind simulator/1: ";
  figures.push_back(
      {without + "what it lacks, no drag, of its gap", no_drag, 0.5, "", Relation::at_least, "most of it"});
  figures.push_back({without + "our sheet imitates its motion to", none.imitated_mm, none.after_mm, "mm",
                     Relation::at_most, "what is left of the recording in the end"});
  figures.push_back({"our sheet, diagnosed behind simulator/1: error before all is put right", own.before_mm,
                     1.2 * own.after_mm, "mm", Relation::at_most, "1.2 times that after"});
}

}  // namespace

std::vector<Figure> prove_simulator(const FigureOptions& options) {
  const std::filesystem::path log =
      std::filesystem::temp_directory_path() / fmt::format("selvedge-prove-simulator-{}.log", ::getpid());
  const trial::Campaign campaign = campaign_behind(options.quick ? 1 : 2, options.quick ? 0.5 : 2, options.seed);
  const int cells = options.quick ? 6 : 12;
  const fit::FitOutcome here = fit::fit_campaign(campaign, fit_behind(cells, std::make_shared<OwnSheetHere>()));
  options.progress(0.33, "in this process");
  const auto simulator = own_sheet_behind(log);
  const FitsApart behind = apart(here, fit::fit_campaign(campaign, fit_behind(cells, simulator)));
  options.progress(0.67, "behind simulator/1");
  constexpr double kRounding_m = 1e-9;
  const FitsApart rounded =
      apart(here, fit::fit_campaign(campaign, fit_behind(cells, std::make_shared<OwnSheetHere>(kRounding_m))));
  options.progress(1, "in this process, each run begun a nanometre aside");
  const double residuals_mm = residuals_apart_mm(here, simulator);
  const std::string what = fmt::format("on {} cells behind simulator/1: ", cells);
  const std::string beside = "in this process, each run begun 1 nm aside";
  std::vector<Figure> figures = {
      {what + "residuals at the same parameters, furthest", residuals_mm, 0.005, "mm", Relation::at_most,
       "a hundredth of what a grid leaves open"},
      {what + "error of a trial after a fit", behind.error_mm, 0.005, "mm", Relation::at_most,
       "digits that fit prints"},
      {what + "parameters of a fit, of half their interval", behind.of_interval_percent, 20, "%", Relation::at_most,
       "costs 0.05 of ln likelihood, which a fit may leave"},
      {what + "the same", behind.of_interval_percent, rounded.of_interval_percent, "%", Relation::shown, beside},
      {what + "parameters of a fit that are determined", behind.determined_percent, rounded.determined_percent, "%",
       Relation::shown, beside},
  };
  if (!options.quick) add_what_it_lacks(figures, campaign, cells, log);
  std::filesystem::remove(log);
  return figures;
}

}  // namespace selvedge::cli
