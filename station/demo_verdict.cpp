#include "station/demo_verdict.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "files/json_number.h"
#include "files/whole_file.h"
#include "station/confirmation.h"
#include "station/diagnosis_folder.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

bool is_effect(const std::string& cause) { return cause != "none" && cause != "unknown"; }

// "air_x 0.09 m/s, air_y 0.24 m/s".
std::string size_in_words(const json& sizes) {
  std::string out;
  for (const auto& [name, p] : sizes.items())
    out += fmt::format("{}{} {:.3g} {} ({:.2g} to {:.2g})", out.empty() ? "" : ", ", name, p.at("value").get<double>(),
                       p.at("unit").get<std::string>(), p.at("interval").at(0).get<double>(),
                       p.at("interval").at(1).get<double>());
  return out;
}

std::string found_in_words(const json& diagnosis) {
  const std::string cause = diagnosis.at("cause");
  const double probability = diagnosis.at("probabilities").at(cause);
  const double gap_mm = diagnosis.at("gap").at("value_mm");
  if (cause == "none") return fmt::format("Diagnosis: nothing is missing (probability {:.2f}).", probability);
  if (cause == "unknown")
    return fmt::format(
        "Diagnosis: the fit leaves a gap of {:.2f} mm that no effect of the library explains "
        "(probability {:.2f}).",
        gap_mm, probability);
  double share = 0;
  for (const json& part : diagnosis.at("budget").at("parts"))
    if (part.at("effects") == json::array({cause})) share = part.at("share");
  return fmt::format("Diagnosis: the fit lacks {}, {}: it takes {:.0f} % of the gap of {:.2f} mm (probability {:.2f}).",
                     cause, size_in_words(diagnosis.at("effect_size").value(cause, json::object())), 100 * share,
                     gap_mm, probability);
}

// "camera_delay (delay -0.011)"; "nothing".
std::string hidden_in_words(const json& hidden) {
  std::string out;
  for (const json& one : hidden) {
    std::string size;
    for (const auto& [name, value] : one.at("size").items())
      size += fmt::format("{}{} {:g}", size.empty() ? "" : ", ", name, value.get<double>());
    out += fmt::format("{}{} ({})", out.empty() ? "" : ", ", one.at("effect").get<std::string>(), size);
  }
  return out.empty() ? "nothing" : out;
}

bool names_what_is_hidden(const std::string& named, const json& hidden) {
  if (hidden.empty()) return named == "none";
  return std::any_of(hidden.begin(), hidden.end(), [&](const json& one) { return one.at("effect") == named; });
}

void list_parameters(DemoVerdict& verdict, const DemoAnswers& answers) {
  for (const auto& [name, truth] : answers.truth.at("parameters").items()) {
    const auto fitted = answers.fit.at("parameters").find(name);
    if (fitted == answers.fit.at("parameters").end()) continue;
    ParameterVerdict p = {name,
                          fitted->at("unit"),
                          fitted->at("value"),
                          fitted->at("interval").at(0),
                          fitted->at("interval").at(1),
                          truth.at("value"),
                          std::nullopt,
                          fitted->at("determined")};
    const json& corrected = answers.diagnosis.at("parameters");
    if (is_effect(verdict.named) && corrected.contains(name)) p.with_effect = corrected[name].at("corrected");
    verdict.parameters.push_back(p);
  }
}

void take_errors(DemoVerdict& verdict, const json& trials) {
  double fitted = 0, held_out = 0, count = 0;
  for (const json& trial : trials) {
    if (!trial.contains("error_held_out") || !trial.contains("error_moving")) continue;
    const double frames = trial.at("frames"), moving = trial["error_moving"], held = trial["error_held_out"];
    fitted += frames * moving * moving;
    held_out += frames * held * held;
    count += frames;
  }
  verdict.fitted_mm = std::sqrt(fitted / count);
  verdict.held_out_mm = std::sqrt(held_out / count);
}

}  // namespace

size_t DemoVerdict::determined() const {
  return static_cast<size_t>(
      std::count_if(parameters.begin(), parameters.end(), [](const auto& p) { return p.determined; }));
}

bool DemoVerdict::parameters_hold() const {
  return determined() > 0 && std::none_of(parameters.begin(), parameters.end(), [](const ParameterVerdict& p) {
           return p.determined && std::abs(p.off_percent()) > kLargestOff_percent;
         });
}

bool DemoVerdict::held_out_holds() const { return held_out_mm <= kLargestRatio * fitted_mm; }

bool DemoVerdict::diagnosis_holds() const { return names_it && (named == "none" || predicts_better); }

DemoAnswers read_demo_answers(const fs::path& folder) {
  const fs::path confirmation = folder / kConfirmationFolder / "confirmation.json";
  return {files::read_json(folder / "fit.json"), files::read_json(folder / diagnosis_folder_name(0) / "diagnosis.json"),
          fs::exists(confirmation) ? files::read_json(confirmation) : json(), files::read_json(folder / "truth.json")};
}

DemoVerdict judge(const DemoAnswers& answers) {
  DemoVerdict verdict;
  verdict.named = answers.diagnosis.at("cause");
  const json hidden = answers.truth.value("hidden", json::array());
  verdict.names_it = names_what_is_hidden(verdict.named, hidden);
  verdict.hidden = hidden_in_words(hidden);
  verdict.diagnosis = found_in_words(answers.diagnosis);
  verdict.truth = fmt::format("Hidden in the simulated world: {}. The diagnosis is {}.", verdict.hidden,
                              verdict.names_it ? "right" : "WRONG");
  verdict.confirmation = answers.confirmation.is_null()
                             ? "No second session: no effect is named that it could confirm."
                             : answers.confirmation.at("verdict").at("sentence").get<std::string>();
  verdict.predicts_better = !answers.confirmation.is_null() && answers.confirmation.at("outcome") != "refuted";
  list_parameters(verdict, answers);
  take_errors(verdict, answers.fit.at("trials"));
  return verdict;
}

std::string to_text(const DemoVerdict& verdict) {
  const bool with = is_effect(verdict.named);
  std::string text = fmt::format("{:<16} {:>10} {:>23} {:>12} {:>10}  {:<10} {:>7}\n", "parameter", "fitted",
                                 "90 % interval", with ? "with effect" : "", "simulated", "unit", "off by");
  for (const ParameterVerdict& p : verdict.parameters)
    text += fmt::format("{:<16} {:>10.4g} {:>11.3g} {:>11.3g} {:>12} {:>10.4g}  {:<10} {:>+5.1f} %  {}\n", p.name,
                        p.found, p.lower, p.upper, p.with_effect ? fmt::format("{:.4g}", *p.with_effect) : "", p.truth,
                        p.unit, p.off_percent(),
                        p.determined ? std::abs(p.off_percent()) <= DemoVerdict::kLargestOff_percent ? "" : "too far"
                                     : "hardly determined");
  text += fmt::format(
      "{} determined parameters, {} within {:.0f} %{}; held-out frames {:.2f} mm, fitted frames in motion {:.2f} mm: "
      "{} "
      "{:.1f} times\n",
      verdict.determined(), verdict.parameters_hold() ? "all" : "NOT all", DemoVerdict::kLargestOff_percent,
      with ? fmt::format(" (compared with {} added)", verdict.named) : "", verdict.held_out_mm, verdict.fitted_mm,
      verdict.held_out_holds() ? "within" : "NOT within", DemoVerdict::kLargestRatio);
  return text + fmt::format("{}\n{}\n{}\n", verdict.diagnosis, verdict.confirmation, verdict.truth);
}

json to_json(const DemoVerdict& verdict) {
  json parameters = json::object();
  for (const ParameterVerdict& p : verdict.parameters)
    parameters[p.name] = {{"fitted", p.found},
                          {"interval", {p.lower, p.upper}},
                          {"with_effect", p.with_effect ? json(*p.with_effect) : json()},
                          {"simulated", p.truth},
                          {"unit", p.unit},
                          {"determined", p.determined},
                          {"off_percent", p.off_percent()}};
  return {{"format", "demo/1"},
          {"parameters", parameters},
          {"held_out_mm", files::finite_or_null(verdict.held_out_mm)},
          {"fitted_mm", files::finite_or_null(verdict.fitted_mm)},
          {"named", verdict.named},
          {"hidden", verdict.hidden},
          {"names_it", verdict.names_it},
          {"diagnosis", verdict.diagnosis},
          {"confirmation", verdict.confirmation},
          {"truth", verdict.truth},
          {"holds",
           {{"parameters", verdict.parameters_hold()},
            {"held_out", verdict.held_out_holds()},
            {"diagnosis", verdict.diagnosis_holds()}}}};
}

}  // namespace selvedge::station
