#include "fit/fit_text.h"

#include <cmath>

#include <fmt/format.h>

#include "fit/trial_errors.h"
#include "report/text_table.h"

namespace selvedge::fit {

namespace {

using report::short_number;

std::string mm_or_dash(double mm) { return std::isfinite(mm) ? fmt::format("{:.2f}", mm) : "-"; }

std::string parameters_text(const FitOutcome& out) {
  std::vector<std::vector<std::string>> rows;
  for (const FittedParameter& p : out.parameters)
    rows.push_back({p.parameter.name, short_number(p.value), p.parameter.unit,
                    short_number(p.lower_interval, 3) + " to " + short_number(p.upper_interval, 3),
                    std::isfinite(p.variability_percent) ? fmt::format("{:.1f} %", p.variability_percent) : "-",
                    p.at_bound     ? "at its bound"
                    : p.determined ? ""
                                   : "hardly determined"});
  return report::text_table({"parameter", "value", "unit", "90 % interval", "for 1 % more error", ""}, rows);
}

}  // namespace

std::string held_out_interval(const TrialError& t, const std::string& between, const std::string& none) {
  if (!t.held_out_interval_mm) return std::isfinite(t.held_out_mm) ? "too short to tell" : none;
  return fmt::format("{:.2f}{}{:.2f}", t.held_out_interval_mm->first, between, t.held_out_interval_mm->second);
}

std::string grid_sentence(const FitOutcome& out) {
  const int cells = out.simulation->options().cells;
  if (out.simulator)
    return fmt::format("Simulated by {}, whose sheet is looked at through {} cells along the width.",
                       out.simulator->name(), cells);
  if (!std::isfinite(out.grid_mm)) return fmt::format("Fitted on a grid of {} cells along the width.", cells);
  return fmt::format(
      "Fitted on a grid of {} cells along the width; the next finer grid moves the fabric by {:.2f} mm "
      "(root mean square), which the parameters take into account.",
      cells, out.grid_mm);
}

std::vector<std::string> remarks_of(const FitOutcome& out) {
  std::vector<std::string> all = out.remarks;
  all.insert(all.end(), out.combinations.begin(), out.combinations.end());
  return all;
}

std::string outcome_text(const FitOutcome& out) {
  std::vector<std::vector<std::string>> rows;
  for (const TrialError& t : out.trials)
    rows.push_back({t.name, mm_or_dash(t.start_mm), mm_or_dash(t.end_mm), mm_or_dash(t.held_out_mm),
                    held_out_interval(t, " to ", "-"), mm_or_dash(t.rigid_plate_mm.value_or(std::nan("")))});
  std::string text =
      parameters_text(out) + "\n" +
      report::text_table({"trial, mm", "start", "fitted", "held out", "90 % interval", "rigid plate"}, rows);
  const double held_out = held_out_mm(out);
  text += std::isfinite(held_out) ? fmt::format("\nheld-out error {:.2f} mm", held_out) : "\nnothing was held out";
  if (const auto plate = rigid_plate_mm(out); plate && std::isfinite(*plate))
    text += fmt::format(", a rigid plate, carried along, {:.2f} mm", *plate);
  text += fmt::format("; {} simulations in {:.0f} s\n{}\n", out.evaluations, out.wall_s, grid_sentence(out));
  for (const std::string& remark : remarks_of(out)) text += remark + "\n";
  return text;
}

}  // namespace selvedge::fit
