// `./selvedge prove simulator`: our own sheet behind simulator/1 gives the fit that it gives in this process, on the
// same grid.
#include <cmath>

#include <fmt/format.h>
#include <unistd.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/simulator_behind.h"

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
  std::filesystem::remove(log);
  const std::string what = fmt::format("on {} cells behind simulator/1: ", cells);
  const std::string beside = "in this process, each run begun 1 nm aside";
  return {
      {what + "residuals at the same parameters, furthest", residuals_mm, 0.005, "mm", Relation::at_most,
       "a hundredth of what a grid leaves open"},
      {what + "error of a trial after a fit", behind.error_mm, 0.005, "mm", Relation::at_most,
       "digits that fit prints"},
      {what + "parameters of a fit, of half their interval", behind.of_interval_percent, 10, "%", Relation::at_most,
       "an interval is known to a tenth at best"},
      {what + "the same", behind.of_interval_percent, rounded.of_interval_percent, "%", Relation::shown, beside},
      {what + "parameters of a fit that are determined", behind.determined_percent, rounded.determined_percent, "%",
       Relation::shown, beside},
  };
}

}  // namespace selvedge::cli
