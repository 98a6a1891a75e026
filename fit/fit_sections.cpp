#include "fit/fit_sections.h"

#include <cmath>

#include <fmt/format.h>

#include "fit/fit_text.h"
#include "model/trial_error.h"
#include "observe/stripe_residual.h"
#include "report/parameter_plots.h"

namespace selvedge::fit {

namespace {

std::string text(double value, const char* format = "{:.2f}") {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "–";
}

std::string text(const std::optional<double>& value) { return value ? text(*value) : "–"; }

// Root mean square at each compared time of a trial.
report::Series error_over_time(const FitOutcome& out, size_t trial, const model::Residuals& residuals,
                               const std::string& name) {
  const model::ObservedTrial& t = out.simulation->trials()[trial];
  const Eigen::VectorXd time = out.simulation->time_s(trial);
  std::vector<double> times;
  if (t.markers) times = t.markers->time_s;
  else
    for (const observe::StripeFrame& f : t.stripes->frames) times.push_back(f.time_s);
  report::Series series;
  series.name = name;
  for (const double s : times) {
    series.x.push_back(s);
    series.y.push_back(model::rms_mm(t, residuals.mm[trial], time, s - 1e-9, s + 1e-9));
  }
  return series;
}

// What nobody can fit has no room to be drawn in.
bool has_bounds(const model::Parameter& p) {
  return std::isfinite(p.lower) && std::isfinite(p.upper) && p.upper > p.lower && (!p.logarithmic || p.lower > 0);
}

void add_forest(report::HtmlReport& html, const FitOutcome& out) {
  std::vector<report::ForestRow> rows;
  for (const FittedParameter& p : out.parameters)
    if (has_bounds(p.parameter))
      rows.push_back({p.parameter.name, p.parameter.unit, p.value, p.lower_interval, p.upper_interval,
                      p.parameter.lower, p.parameter.upper, p.start, p.parameter.logarithmic});
  if (!rows.empty())
    html.svg(report::forest_plot(rows),
             "Each parameter between its bounds, on a logarithmic axis unless it says linear: the value, its 90 % "
             "interval, and where the search started. A bar across the whole line: these trials do not show it");
}

void add_correlations(report::HtmlReport& html, const FitOutcome& out) {
  const auto n = static_cast<Eigen::Index>(out.parameters.size());
  if (n < 2 || out.correlation.rows() != n) return;
  std::vector<std::string> labels;
  std::vector<double> r;
  for (Eigen::Index i = 0; i < n; ++i) {
    labels.push_back(out.parameters[static_cast<size_t>(i)].parameter.name);
    for (Eigen::Index j = 0; j < n; ++j) r.push_back(out.correlation(i, j));
  }
  html.svg(report::correlation_map(labels, r),
           "Which parameters these trials cannot tell apart. Near 0: each is found by itself. Near -1: one may rise "
           "while the other falls, and the simulation stays the same. Near +1: they may rise together");
}

}  // namespace

void add_parameters(report::HtmlReport& html, const FitOutcome& out) {
  html.heading("Parameters");
  std::vector<std::vector<std::string>> rows;
  for (const FittedParameter& p : out.parameters)
    rows.push_back({p.parameter.name, fmt::format("{:.4g}", p.value), p.parameter.unit,
                    fmt::format("{:.3g} … {:.3g}", p.lower_interval, p.upper_interval),
                    fmt::format("{:.1f}", p.variability_percent), fmt::format("{:.1f}", p.mesh_percent),
                    fmt::format("{:.3g}", p.start),
                    p.at_bound     ? "at its bound"
                    : p.determined ? "determined"
                                   : "hardly determined"});
  html.table({"parameter", "value", "unit", "90 % interval", "change that makes the error 1 % larger, %",
              "uncertain because of the grid, %", "start", "verdict"},
             rows);
  add_forest(html, out);
  add_correlations(html, out);
  html.paragraph(grid_sentence(out));
  for (const std::string& remark : out.remarks) html.paragraph(remark + ".");
}

namespace {

// Of markers, in space: what their noise alone leaves, mm.
std::optional<double> noise_mm(const model::ObservedTrial& trial) {
  if (!trial.markers) return std::nullopt;
  double sum = 0;
  const std::vector<double> noise_m = model::marker_noise_m(trial);
  for (const double m : noise_m) sum += m * m;
  if (!(sum > 0)) return std::nullopt;
  return 1e3 * std::sqrt(3 * sum / static_cast<double>(noise_m.size()));
}

void add_error_over_time(report::HtmlReport& html, const FitOutcome& out, size_t trial) {
  report::PlotOptions plot;
  plot.x_label = "time, s";
  plot.y_label = "error, mm";
  plot.height_px = 220;
  const bool is_cut = out.cut_s < 1e299;
  if (is_cut) plot.shaded = {{out.cut_s, 1e300}};
  plot.shaded_name = "held out";
  plot.level = noise_mm(out.simulation->trials()[trial]);
  plot.level_name = "noise of the markers";
  html.svg(report::line_plot({error_over_time(out, trial, out.residuals_start, "start"),
                              error_over_time(out, trial, out.residuals, "fitted")},
                             plot),
           fmt::format("{}: root mean square error over time{}", out.trials[trial].name,
                       is_cut ? fmt::format("; shaded, after {:.2f} s: not fitted", out.cut_s) : ""));
}

}  // namespace

void add_errors(report::HtmlReport& html, const FitOutcome& out) {
  html.heading("Error of each trial");
  std::vector<std::vector<std::string>> rows;
  for (const TrialError& t : out.trials)
    rows.push_back({t.name, std::to_string(t.frames), text(t.start_mm), text(t.end_mm), text(t.moving_mm),
                    text(t.held_out_mm), held_out_interval(t, " … ", "–"), text(t.rigid_plate_mm),
                    text(t.velocity_end_mm_s)});
  html.table({"trial", "compared times", "start, mm", "fitted, mm", "of that in motion, mm", "held out, mm", "90 %",
              "rigid plate, mm", "velocity error, mm/s"},
             rows);
  html.paragraph(out.hold_out == "trials"
                     ? "Held out: each half of the trials predicted with parameters fitted to the other half alone."
                 : out.hold_out == "frames" ? "Held out: the last third of the frames, which the fit did not see."
                                            : "Nothing was held out.");
  for (size_t i = 0; i < out.trials.size(); ++i)
    if (!out.simulation->trials()[i].still) add_error_over_time(html, out, i);
}

namespace {

// Best error so far and, where there is one, the temperature, against evaluations (figure 5 of Bhat et al. 2003).
void add_search(report::HtmlReport& html, const FitOutcome& out) {
  report::Series best{"best error", {}, {}}, temperature{"temperature", {}, {}};
  for (const estimate::SearchStep& step : out.trace) {
    best.x.push_back(step.evaluations);
    best.y.push_back(step.best_cost);
    if (!std::isfinite(step.temperature)) continue;
    temperature.x.push_back(step.evaluations);
    temperature.y.push_back(step.temperature);
  }
  std::vector<report::Series> series = {best};
  if (!temperature.x.empty()) series.push_back(temperature);
  report::PlotOptions plot;
  plot.x_label = "evaluations";
  plot.y_label = "error, and temperature in its unit";
  plot.log_y = true;
  html.svg(report::line_plot(series, plot),
           fmt::format("{}: {} evaluations", out.optimiser, out.trace.back().evaluations));
}

}  // namespace

void add_progress(report::HtmlReport& html, const FitOutcome& out) {
  html.heading("Progress of the fit");
  if (!out.trace.empty()) {
    add_search(html, out);
    return;
  }
  report::Series series;
  series.name = "cost";
  for (size_t i = 0; i < out.history.size(); ++i) {
    series.x.push_back(static_cast<double>(i));
    series.y.push_back(out.history[i]);
  }
  report::PlotOptions plot;
  plot.x_label = "iteration on the final grid";
  plot.y_label = "cost";
  plot.log_y = true;
  html.svg(report::line_plot({series}, plot),
           fmt::format("{} simulations of the campaign, {:.0f} s", out.evaluations, out.wall_s));
}

}  // namespace selvedge::fit
