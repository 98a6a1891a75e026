#include "station/demo_verdict.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace selvedge::station {

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

DemoVerdict judge(const fit::FitOutcome& outcome, const nlohmann::json& truth) {
  DemoVerdict verdict;
  for (const fit::FittedParameter& fitted : outcome.parameters) {
    const auto known = truth.at("parameters").find(fitted.parameter.name);
    if (known == truth.at("parameters").end()) continue;
    verdict.parameters.push_back({fitted.parameter.name, fitted.parameter.unit, fitted.value, fitted.lower_interval,
                                  fitted.upper_interval, known->at("value").get<double>(), fitted.determined});
  }
  double fitted = 0, held_out = 0, count = 0;
  for (const fit::TrialError& trial : outcome.trials) {
    if (!std::isfinite(trial.held_out_mm) || !std::isfinite(trial.moving_mm)) continue;
    const auto frames = static_cast<double>(trial.frames);
    fitted += frames * trial.moving_mm * trial.moving_mm;
    held_out += frames * trial.held_out_mm * trial.held_out_mm;
    count += frames;
  }
  verdict.fitted_mm = std::sqrt(fitted / count);
  verdict.held_out_mm = std::sqrt(held_out / count);
  return verdict;
}

std::string to_text(const DemoVerdict& verdict) {
  std::string text = fmt::format("{:<16} {:>10} {:>23} {:>10}  {:<10} {:>7}\n", "parameter", "found", "90 % interval",
                                 "simulated", "unit", "off by");
  for (const ParameterVerdict& p : verdict.parameters)
    text += fmt::format("{:<16} {:>10.4g} {:>11.3g} {:>11.3g} {:>10.4g}  {:<10} {:>+5.1f} %  {}\n", p.name, p.found,
                        p.lower, p.upper, p.truth, p.unit, p.off_percent(),
                        p.determined ? std::abs(p.off_percent()) <= DemoVerdict::kLargestOff_percent ? "" : "too far"
                                     : "hardly determined");
  text += fmt::format(
      "{} determined parameters, {} within {:.0f} %; held-out frames {:.2f} mm, fitted frames in motion {:.2f} mm: {} "
      "{:.1f} times\n",
      verdict.determined(), verdict.parameters_hold() ? "all" : "NOT all", DemoVerdict::kLargestOff_percent,
      verdict.held_out_mm, verdict.fitted_mm, verdict.held_out_holds() ? "within" : "NOT within",
      DemoVerdict::kLargestRatio);
  return text;
}

}  // namespace selvedge::station
