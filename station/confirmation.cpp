#include "station/confirmation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>
#include <tbb/parallel_invoke.h>

#include "capture/trial/trial.h"
#include "diagnose/effects/library.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "fit/fit_campaign.h"
#include "fit/stages.h"
#include "model/excerpts.h"
#include "model/trial_error.h"
#include "station/diagnosis_folder.h"
#include "station/simulated_motion.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using nlohmann::json;

const json& at(const json& object, const char* key, const fs::path& file) {
  const auto found = object.find(key);
  if (found == object.end()) refuse(file.string() + " " + key, "found nothing, expected what Selvedge writes there");
  return *found;
}

[[noreturn]] void refuse_damaged(const std::string& where, const json::exception& error) {
  refuse(where, "found {}; expected what Selvedge writes there", error.what());
}

// Of the first session.
fs::path diagnosis_file(const fs::path& fabric) { return fabric / diagnosis_folder_name(0) / "diagnosis.json"; }

FirstAnswers read_answers(const fs::path& fabric) {
  const fs::path fit = fabric / "fit.json", diagnosis = diagnosis_file(fabric);
  FirstAnswers out = {files::read_json(fit), files::read_json(diagnosis)};
  for (const char* key : {"parameters", "grid"}) at(out.fit, key, fit);
  for (const char* key : {"cause", "likeliest", "fit", "base", "grid_cells", "forecast"})
    at(out.diagnosis, key, diagnosis);
  return out;
}

// Of the base, and of those effects that one of the diagnosis' answers has away from neutral.
std::vector<model::Parameter> parameters_of(const json& diagnosis) {
  const std::vector<model::Parameter> base =
      model::base_parameters(model::drag_named(diagnosis["base"].get<std::string>()));
  const json &none = diagnosis["fit"].at("none"),
             &with = diagnosis["fit"].at(diagnosis["likeliest"].get<std::string>());
  // An effect's parameter may have the name of one of the base, which then is that effect already.
  const auto is_used = [&](const model::Parameter& p) {
    return model::place_of(base, p.name) == base.size() && (none.contains(p.name) || with.contains(p.name));
  };
  std::vector<model::Parameter> out = base;
  for (const diagnose::Effect& effect : diagnose::effect_library())
    if (std::any_of(effect.parameters.begin(), effect.parameters.end(), is_used))
      out.insert(out.end(), effect.parameters.begin(), effect.parameters.end());
  return out;
}

// values: by name, in their units.
VectorXd coordinates_at(const std::vector<model::Parameter>& parameters, const json& values) {
  VectorXd x = model::usual_coordinates(parameters);
  for (const auto& [name, value] : values.get_ref<const json::object_t&>()) {
    const size_t place = model::place_of(parameters, name);
    if (place < parameters.size())
      x(static_cast<Eigen::Index>(place)) = model::to_coordinate(parameters[place], value.get<double>());
  }
  return x;
}

json values_of_fit(const json& fit) {
  json out = json::object();
  for (const auto& [name, parameter] : fit["parameters"].items()) out[name] = parameter.at("value");
  return out;
}

// Errors of all trials, from where each moves.
std::vector<double> errors_of(const model::Simulation& simulation, const model::Residuals& residuals, double moving_s) {
  std::vector<double> out;
  for (size_t i = 0; i < simulation.trials().size(); ++i) {
    const model::ObservedTrial& trial = simulation.trials()[i];
    const double from_s = trial.still ? -1e300 : model::first_move_s(trial),
                 to_s = trial.still ? 1e300 : from_s + moving_s;
    out.push_back(model::rms_mm(trial, residuals.mm[i], simulation.time_s(i), from_s, to_s));
  }
  return out;
}

// Of each trial what the diagnosis forecasts, and a little more: clocks that drift and shutters that roll look ahead.
std::vector<model::ObservedTrial> forecast_of(const std::vector<model::ObservedTrial>& trials, double moving_s) {
  constexpr double kAhead_s = 0.1;
  std::vector<model::ObservedTrial> out;
  for (const model::ObservedTrial& trial : trials)
    out.push_back(model::beginning_of(trial, model::first_move_s(trial) + moving_s + kAhead_s));
  return out;
}

double pooled(const std::vector<ConfirmedTrial>& trials, double ConfirmedTrial::*error) {
  double sum = 0;
  for (const ConfirmedTrial& t : trials) sum += t.*error * t.*error;
  return std::sqrt(sum / static_cast<double>(trials.size()));
}

// As shares, so that a motion which both predict worse than was thought is not taken for a confirmation.
Confirmation::Outcome outcome_of(const Confirmation& c) {
  const auto share = [](double before, double after) { return 1 - after * after / (before * before); };
  const double fell = share(c.before_mm, c.after_mm);
  if (!(fell > 0)) return Confirmation::Outcome::refuted;
  const bool as_far = fell >= 0.5 * share(c.forecast_before_mm, c.forecast_after_mm),
             as_near = c.after_mm <= 2 * c.forecast_after_mm;
  return as_far && as_near ? Confirmation::Outcome::confirmed : Confirmation::Outcome::better;
}

void take_forecast(Confirmation& out, const json& forecast, const fs::path& file) {
  out.motion = forecast.at("motion");
  // Diagnoses of earlier versions forecast all of it.
  const json moving_s = forecast.value("moving_s", json());
  out.moving_s = moving_s.is_null() ? std::numeric_limits<double>::infinity() : moving_s.get<double>();
  if (!(out.moving_s > 0))
    refuse(file.string() + " forecast.moving_s", "found {}, expected a time above 0 s", out.moving_s);
  out.forecast_before_mm = forecast.at("before_mm");
  out.forecast_after_mm = forecast.at("after_mm");
  const auto bound = [&](size_t i) {
    const json& value = forecast.at("interval_mm").at(i);
    return value.is_number() ? value.get<double>() : std::nan("");
  };
  out.forecast_low_mm = bound(0);
  out.forecast_high_mm = bound(1);
}

}  // namespace

std::optional<session::SessionPlan> plan_of_second_session(const session::SessionPlan& recorded,
                                                           const fs::path& diagnosis) {
  if (!fs::exists(diagnosis / "diagnosis.json")) return std::nullopt;
  const json said = files::read_json(diagnosis / "diagnosis.json");
  const auto forecast = said.find("forecast");
  if (forecast == said.end()) return std::nullopt;
  std::string like_trial;
  double speed = 1;
  try {
    like_trial = forecast->value("like_trial", "");
    speed = forecast->value("speed", 1.0);
  } catch (const json::exception& error) {
    refuse_damaged((diagnosis / "diagnosis.json").string() + " forecast", error);
  }
  const auto like = std::find_if(recorded.trials.begin(), recorded.trials.end(),
                                 [&](const session::TrialPlan& t) { return t.name == like_trial; });
  if (like == recorded.trials.end()) return std::nullopt;
  session::SessionPlan plan = recorded;
  plan.trials = {*like};
  plan.trials[0].name = "second-1";
  plan.trials[0].frequency_hz *= speed;
  return plan;
}

Confirmation confirm(const fs::path& fabric, const report::ProgressCallback& progress) {
  return confirm(read_answers(fabric), trial::read_campaign(fabric / kConfirmationFolder), fabric / kConfirmationFolder,
                 progress);
}

namespace {

Confirmation found_by(const FirstAnswers& answers, const trial::Campaign& second, const fs::path& folder,
                      const report::ProgressCallback& progress) {
  Confirmation out;
  out.cause = answers.diagnosis["cause"];
  out.likeliest = answers.diagnosis["likeliest"];
  take_forecast(out, answers.diagnosis["forecast"], diagnosis_file(folder.parent_path()));
  const json& diagnosed_on = answers.diagnosis["grid_cells"];
  out.cells = std::max(answers.fit["grid"].at("cells").get<int>(), diagnosed_on.at(1).get<int>());
  model::SimulationOptions grid, usual;
  grid.cells = out.cells;
  usual.cells = diagnosed_on.at(0).get<int>();
  const fit::FitOptions how;
  const std::vector<model::ObservedTrial> trials =
      fit::observe_campaign(second, how.rate_hz, how.image_rate_hz, fit::part_of(progress, 0, 0.1, "second session"));
  const std::vector<model::Parameter> parameters = parameters_of(answers.diagnosis);
  progress(0.1, "predicting the second session");
  MatrixXd sets(static_cast<Eigen::Index>(parameters.size()), 3);
  sets.col(0) = coordinates_at(parameters, values_of_fit(answers.fit));
  sets.col(1) = coordinates_at(parameters, answers.diagnosis["fit"].at("none"));
  const VectorXd with = coordinates_at(parameters, answers.diagnosis["fit"].at(out.likeliest));
  sets.col(2) = with;
  const model::Simulation compared(forecast_of(trials, out.moving_s), grid);
  // The whole motion is only looked at: the finest grid would take four times as long for it.
  const model::Simulation shown(trials, usual);
  std::vector<model::Residuals> by;
  tbb::parallel_invoke([&] { by = compared.evaluate(compared.state_at(parameters, with), parameters, sets); },
                       [&] {
    write_simulated_motions({shown, shown.state_at(parameters, with), parameters, with}, second, folder);
  });
  const auto errors = [&](const model::Residuals& r) { return errors_of(compared, r, out.moving_s); };
  const std::vector<double> fit_mm = errors(by[0]), base_mm = errors(by[1]), with_mm = errors(by[2]);
  for (size_t i = 0; i < with_mm.size(); ++i) out.trials.push_back({trials[i].name, fit_mm[i], base_mm[i], with_mm[i]});
  out.before_mm = pooled(out.trials, &ConfirmedTrial::fit_mm);
  out.base_mm = pooled(out.trials, &ConfirmedTrial::base_mm);
  out.after_mm = pooled(out.trials, &ConfirmedTrial::with_mm);
  out.outcome = outcome_of(out);
  return out;
}

}  // namespace

Confirmation confirm(const FirstAnswers& answers, const trial::Campaign& second, const fs::path& folder,
                     const report::ProgressCallback& progress) {
  try {
    return found_by(answers, second, folder, progress);
  } catch (const json::exception& error) {
    const fs::path first = folder.parent_path();
    refuse_damaged((first / "fit.json").string() + " or " + diagnosis_file(first).string(), error);
  }
}

}  // namespace selvedge::station
