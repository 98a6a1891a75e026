// A confirmation in words, as JSON and as a page.
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "diagnose/diagnosis_words.h"
#include "files/json_number.h"
#include "files/whole_file.h"
#include "report/html.h"
#include "station/confirmation.h"

namespace selvedge::station {

namespace {

using nlohmann::json;
using Outcome = Confirmation::Outcome;

std::string mm(double value) { return std::isfinite(value) ? fmt::format("{:.2f}", value) : "–"; }

std::string forecast_in_words(const Confirmation& c) {
  const std::string interval = std::isfinite(c.forecast_low_mm) && std::isfinite(c.forecast_high_mm)
                                   ? fmt::format(" (90 %: {:.1f} to {:.1f})", c.forecast_low_mm, c.forecast_high_mm)
                                   : "";
  return fmt::format("The diagnosis forecast {:.1f} mm{} without, and {:.1f} mm with it.", c.forecast_before_mm,
                     interval, c.forecast_after_mm);
}

json confirmation_json(const Confirmation& c) {
  json trials = json::object();
  for (const ConfirmedTrial& t : c.trials)
    trials[t.name] = {{"before_mm", files::finite_or_null(t.fit_mm)},
                      {"base_mm", files::finite_or_null(t.base_mm)},
                      {"after_mm", files::finite_or_null(t.with_mm)}};
  return {{"format", "confirmation/1"},
          {"verdict", report::to_json(verdict_of(c))},
          {"outcome", to_text(c.outcome)},
          {"cause", c.cause},
          {"likeliest", c.likeliest},
          {"motion", c.motion},
          {"moving_s", files::finite_or_null(c.moving_s)},
          {"trials", trials},
          {"before_mm", files::finite_or_null(c.before_mm)},
          {"base_mm", files::finite_or_null(c.base_mm)},
          {"after_mm", files::finite_or_null(c.after_mm)},
          {"forecast",
           {{"before_mm", c.forecast_before_mm},
            {"interval_mm", {files::finite_or_null(c.forecast_low_mm), files::finite_or_null(c.forecast_high_mm)}},
            {"after_mm", c.forecast_after_mm}}},
          {"grid_cells", c.cells}};
}

}  // namespace

const char* to_text(Outcome outcome) {
  switch (outcome) {
    case Outcome::confirmed: return "confirmed";
    case Outcome::better: return "better";
    case Outcome::refuted: break;
  }
  return "refuted";
}

report::Verdict verdict_of(const Confirmation& c) {
  report::Verdict verdict;
  verdict.sentence = fmt::format(
      "A second session ({}) is predicted with an error of {} mm by the fit as it was, and of {} mm with {} added: the "
      "diagnosis is {}. {}",
      diagnose::motion_in_words(c.motion, c.moving_s), mm(c.before_mm), mm(c.after_mm), c.likeliest,
      c.outcome == Outcome::confirmed ? "confirmed"
      : c.outcome == Outcome::better  ? "confirmed in part"
                                      : "not confirmed",
      forecast_in_words(c));
  if (c.outcome == Outcome::better)
    verdict.lower(report::Trust::limited,
                  "the error falls by less than half of what was forecast, or stays more than twice as large");
  if (c.outcome == Outcome::refuted)
    verdict.lower(report::Trust::none, "the effect does not make the prediction better");
  return verdict;
}

void write_confirmation(const Confirmation& c, const std::filesystem::path& folder) {
  report::HtmlReport html("Second session, as the diagnosis predicts it");
  html.verdict(verdict_of(c));
  html.paragraph(
      "Nothing was fitted to this session. Each trial is simulated from rest, and compared from the held corners' "
      "first move on, for as long as the diagnosis forecasts; errors are root mean squares in mm.");
  std::vector<std::vector<std::string>> rows;
  for (const ConfirmedTrial& t : c.trials) rows.push_back({t.name, mm(t.fit_mm), mm(t.base_mm), mm(t.with_mm)});
  rows.push_back({"all", mm(c.before_mm), mm(c.base_mm), mm(c.after_mm)});
  html.table({"trial", "by the fit as it was", "by the diagnosis' base model", "with " + c.likeliest}, rows);
  html.links({{"the diagnosis", "../diagnosis/report.html"}, {"the fit", "../report.html"}});
  html.write(folder / "report.html");
  files::write_json(folder / "confirmation.json", confirmation_json(c));
}

}  // namespace selvedge::station
