#include "fit/fit_report.h"

#include <cmath>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "files/json_reader.h"
#include "files/json_number.h"
#include "files/whole_file.h"
#include "fit/fit_pictures.h"
#include "fit/fit_verdict.h"
#include "model/trial_error.h"
#include "observe/stripe_residual.h"
#include "report/html.h"

namespace selvedge::fit {

namespace {

using nlohmann::json;

std::string text(double value, const char* format = "{:.2f}") {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "–";
}

std::string text(const std::optional<double>& value) { return value ? text(*value) : "–"; }

std::string interval_text(const std::optional<model::Interval>& interval) {
  return interval ? fmt::format("{:.2f} … {:.2f}", interval->first, interval->second) : "–";
}

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
  html.table({"parameter", "value", "unit", "90 % interval", "change for 1 % of error, %", "left open by the grid, %",
              "start", "verdict"},
             rows);
  html.paragraph(grid_sentence(out));
  for (const std::string& remark : out.remarks) html.paragraph(remark + ".");
}

void add_errors(report::HtmlReport& html, const FitOutcome& out) {
  html.heading("Error of each trial");
  std::vector<std::vector<std::string>> rows;
  for (const TrialError& t : out.trials)
    rows.push_back({t.name, std::to_string(t.frames), text(t.start_mm), text(t.end_mm), text(t.moving_mm),
                    text(t.held_out_mm), interval_text(t.held_out_interval_mm), text(t.rigid_plate_mm),
                    text(t.velocity_end_mm_s)});
  html.table({"trial", "compared times", "start, mm", "fitted, mm", "of that in motion, mm", "held out, mm", "90 %",
              "rigid plate, mm", "velocity error, mm/s"},
             rows);
  html.paragraph(out.hold_out == "trials"
                     ? "Held out: each half of the trials predicted with parameters fitted to the other half alone."
                 : out.hold_out == "frames" ? "Held out: the last third of the frames, which the fit did not see."
                                            : "Nothing was held out.");
  for (size_t i = 0; i < out.trials.size(); ++i) {
    if (out.simulation->trials()[i].still) continue;
    report::PlotOptions plot;
    plot.x_label = "time, s";
    plot.y_label = "error, mm";
    plot.height_px = 220;
    html.svg(report::line_plot({error_over_time(out, i, out.residuals_start, "start"),
                                error_over_time(out, i, out.residuals, "fitted")},
                               plot),
             fmt::format("{}: root mean square error over time{}", out.trials[i].name,
                         out.cut_s < 1e299 ? fmt::format("; held out after {:.2f} s", out.cut_s) : ""));
  }
}

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

}  // namespace

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

json to_json(const FitOutcome& out) {
  json parameters = json::object(), trials = json::object();
  for (const FittedParameter& p : out.parameters)
    parameters[p.parameter.name] = {{"value", p.value},
                                    {"unit", p.parameter.unit},
                                    {"variability_percent", p.variability_percent},
                                    {"interval", {p.lower_interval, p.upper_interval}},
                                    {"at_bound", p.at_bound},
                                    {"mesh_percent", p.mesh_percent},
                                    {"determined", p.determined},
                                    {"start", p.start}};
  for (const TrialError& t : out.trials) {
    trials[t.name] = {{"error_start", files::finite_or_null(t.start_mm)},
                      {"error_end", files::finite_or_null(t.end_mm)},
                      {"frames", t.frames}};
    if (std::isfinite(t.moving_mm)) trials[t.name]["error_moving"] = t.moving_mm;
    if (std::isfinite(t.held_out_mm)) trials[t.name]["error_held_out"] = t.held_out_mm;
    if (t.held_out_in_noise) trials[t.name]["error_held_out_in_noise"] = *t.held_out_in_noise;
    if (t.held_out_interval_mm)
      trials[t.name]["error_held_out_interval"] = {t.held_out_interval_mm->first, t.held_out_interval_mm->second};
    if (t.rigid_plate_mm) trials[t.name]["error_rigid_plate"] = *t.rigid_plate_mm;
    if (t.velocity_end_mm_s) trials[t.name]["velocity_error_end_mm_s"] = *t.velocity_end_mm_s;
  }
  json out_json = {{"format", "fit/1"},
                   {"model", out.model},
                   {"campaign", out.campaign},
                   {"parameters", parameters},
                   {"trials", trials},
                   {"units", "mm root mean square"},
                   {"evaluations", out.evaluations},
                   {"wall_s", out.wall_s},
                   {"remarks", out.remarks},
                   {"held_out", {{"by", out.hold_out}, {"error", files::finite_or_null(held_out_mm(out))}}}};
  out_json["optimiser"] = out.optimiser;
  out_json["grid"] = {{"cells", out.simulation->options().cells},
                      {"next_finer_moves_mm", files::finite_or_null(out.grid_mm)}};
  out_json["input"] = out.input;
  out_json["verdict"] = report::to_json(verdict_of(out));
  if (out.delay) out_json["delay"] = {{"delay_s", out.delay->delay_s}, {"sd_s", out.delay->sd_s}};
  if (out.simulator) out_json["simulator"] = {{"name", out.simulator->name()}, {"is", out.simulator->identity()}};
  if (!out.tests.empty()) out_json["material_tests"] = material_tests::to_json(out.tests);
  if (const auto plate = rigid_plate_mm(out)) out_json["held_out"]["rigid_plate_error"] = *plate;
  return out_json;
}

std::optional<Eigen::VectorXd> read_fit(const std::filesystem::path& file, const std::string& input,
                                        const std::vector<model::Parameter>& base) {
  const files::JsonReader fit(file);
  if (fit.text("format") != "fit/1") refuse(fit.where("format"), "found {}, expected fit/1", fit.text("format"));
  if (!fit.has("input") || fit.text("input") != input) return std::nullopt;
  const files::JsonReader parameters = fit.child("parameters");
  Eigen::VectorXd coordinates(static_cast<Eigen::Index>(base.size()));
  for (size_t k = 0; k < base.size(); ++k)
    coordinates(static_cast<Eigen::Index>(k)) =
        model::to_coordinate(base[k], base[k].logarithmic ? parameters.child(base[k].name).positive("value")
                                                          : parameters.child(base[k].name).number("value"));
  return coordinates;
}

void write_fit(const FitOutcome& out, const trial::Campaign& campaign, const std::filesystem::path& folder) {
  report::HtmlReport html("Fit of " + out.campaign);
  html.verdict(verdict_of(out));
  html.paragraph(fmt::format(
      "Model: {}. Held-out error {} mm root mean square{}.", out.model, text(held_out_mm(out)),
      rigid_plate_mm(out) ? fmt::format("; a rigid plate on the same bar: {} mm", text(rigid_plate_mm(out))) : ""));
  add_parameters(html, out);
  add_errors(html, out);
  add_pictures(html, out, campaign);
  add_progress(html, out);
  material_tests::add_to_report(html, out.tests);
  std::filesystem::create_directories(folder);
  html.write(folder / "report.html");
  json fit = to_json(out);
  const trial::Trial& first = campaign.trials.front();
  fit["fabric"] = {{"name", first.fabric.name}, {"areal_mass", trial::areal_mass(first)}};
  files::write_json(folder / "fit.json", fit);
}

}  // namespace selvedge::fit
