#include "fit/fit_verdict.h"
#include "fit/trial_errors.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace selvedge::fit {

using report::Trust;

namespace {

constexpr double kAstray = 0.1;  // of the swatch's height
constexpr double kTimesFitted = 2, kGridLeaves_mm = 1;

struct Counts {
  size_t all = 0, at_bound = 0, determined = 0;
  std::string names_at_bound;
};

Counts counts_of(const FitOutcome& out) {
  Counts c;
  c.all = out.parameters.size();
  for (const FittedParameter& p : out.parameters) {
    if (p.determined) ++c.determined;
    if (!p.at_bound) continue;
    ++c.at_bound;
    c.names_at_bound += (c.names_at_bound.empty() ? "" : ", ") + p.parameter.name;
  }
  return c;
}

double height_mm(const FitOutcome& out) { return 1e3 * out.simulation->trials().front().height_m; }

void weigh_held_out(const FitOutcome& out, report::Verdict& verdict) {
  const double held_out = held_out_mm(out), fitted = fitted_mm(out);
  if (!std::isfinite(held_out)) {
    verdict.lower(Trust::limited, "nothing was held out: whether it predicts another motion is not known");
    return;
  }
  if (held_out > kAstray * height_mm(out))
    verdict.lower(Trust::none,
                  fmt::format("what it did not see it misses by {:.1f} mm, over a tenth of the swatch", held_out));
  if (const auto plate = rigid_plate_mm(out); plate && held_out >= *plate)
    verdict.lower(Trust::none,
                  fmt::format("a rigid plate, carried along by what is held, comes as near: {:.1f} mm beside {:.1f}",
                              *plate, held_out));
  if (held_out > kTimesFitted * fitted)
    verdict.lower(Trust::limited, fmt::format("what it did not see it misses by {:.1f} times what it was fitted to",
                                              held_out / fitted));
}

}  // namespace

report::Verdict verdict_of(const FitOutcome& out) {
  report::Verdict verdict;
  const Counts c = counts_of(out);
  const double held_out = held_out_mm(out);
  verdict.sentence =
      std::isfinite(held_out)
          ? fmt::format("the fit predicts what it did not see to {:.2f} mm, and determines {} of {} parameters",
                        held_out, c.determined, c.all)
          : fmt::format("the fit determines {} of {} parameters", c.determined, c.all);
  for (const std::string& doubt : out.doubts) verdict.lower(Trust::none, "the recording is doubted: " + doubt);
  weigh_held_out(out, verdict);
  if (c.at_bound > 0)
    verdict.lower(2 * c.at_bound >= c.all ? Trust::none : Trust::limited,
                  fmt::format("{} of {} parameters end{} at a bound: {}", c.at_bound, c.all, c.at_bound == 1 ? "s" : "",
                              c.names_at_bound));
  if (2 * c.determined < c.all)
    verdict.lower(Trust::limited,
                  fmt::format("{} of {} parameters are hardly determined", c.all - c.determined, c.all));
  if (out.grid_mm > kGridLeaves_mm)
    verdict.lower(Trust::limited, fmt::format("the next finer grid moves the fabric by {:.1f} mm", out.grid_mm));
  return verdict;
}

}  // namespace selvedge::fit
