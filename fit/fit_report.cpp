#include "fit/fit_report.h"

#include <cmath>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "files/json_number.h"
#include "files/json_reader.h"
#include "files/whole_file.h"
#include "fit/fit_pictures.h"
#include "fit/fit_sections.h"
#include "fit/fit_text.h"
#include "fit/fit_verdict.h"
#include "fit/trial_errors.h"
#include "report/html.h"

namespace selvedge::fit {

namespace {

using nlohmann::json;

std::string mm_text(const std::optional<double>& mm) {
  return mm && std::isfinite(*mm) ? fmt::format("{:.2f} mm", *mm) : "not known";
}

}  // namespace

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
                   {"remarks", remarks_of(out)},
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
  html.input(out.input);
  html.paragraph(fmt::format(
      "Model: {}. Held-out error {}, root mean square{}.", out.model, mm_text(held_out_mm(out)),
      rigid_plate_mm(out) ? fmt::format("; of a rigid plate, carried along, {}", mm_text(rigid_plate_mm(out))) : ""));
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
