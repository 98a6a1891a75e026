// write_comparison and comparison_text of station/comparison.h: the page, from what compare.json holds
// and the figures of the reports beside the results.
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "files/whole_file.h"
#include "report/html.h"
#include "report/text_table.h"
#include "station/comparison.h"
#include "station/comparison_figures.h"
#include "station/json_text.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using report::short_number;

std::string word_text(const json& value) { return value.is_string() ? value.get<std::string>() : "–"; }

std::string signed_text(const json& value) {
  if (!value.is_number()) return "–";
  return (value.get<double>() > 0 ? "+" : "") + short_number(value.get<double>(), 3);
}

std::string percent_text(const json& value) {
  return value.is_number() ? fmt::format("{:.0f} %", 100 * value.get<double>()) : "–";
}

std::string with_interval(const json& value, const json& interval) {
  const std::string number = number_text(value);
  return interval.is_null() ? number
                            : fmt::format("{} ({} … {})", number, number_text(interval[0]), number_text(interval[1]));
}

std::string share_with_interval(const json& share, const json& interval) {
  return interval.is_null()
             ? percent_text(share)
             : fmt::format("{} ({} … {})", percent_text(share), percent_text(interval[0]), percent_text(interval[1]));
}

std::string parameter_text(const json& p) {
  if (p.is_null()) return "–";
  const bool at_bound = p["at_bound"] == json(true), open = p["determined"] == json(false);
  return with_interval(p["value"], p["interval"]) + (at_bound ? ", at its bound" : open ? ", hardly determined" : "");
}

double or_nan(const json& value) { return value.is_number() ? value.get<double>() : std::nan(""); }

// Each parameter in units of A's value, so that all fit one axis.
void add_interval_plot(report::HtmlReport& html, const json& parameters) {
  std::vector<std::string> labels;
  std::vector<report::IntervalSeries> series = {{"A", {}, {}, {}}, {"B", {}, {}, {}}};
  for (const auto& [name, p] : parameters.items()) {
    if (!p["ratio"].is_number() || p["ratio"].get<double>() <= 0) continue;
    labels.push_back(name);
    const double unit = p["a"]["value"].get<double>();
    for (size_t side = 0; side < 2; ++side) {
      const json& one = p[side == 0 ? "a" : "b"];
      series[side].value.push_back(or_nan(one["value"]) / unit);
      series[side].low.push_back(one["interval"].is_null() ? std::nan("") : or_nan(one["interval"][0]) / unit);
      series[side].high.push_back(one["interval"].is_null() ? std::nan("") : or_nan(one["interval"][1]) / unit);
    }
  }
  if (labels.empty()) return;
  report::PlotOptions plot;
  plot.x_label = "value over A's value";
  plot.log_x = true;
  html.svg(report::interval_plot(labels, series, plot),
           "Parameters with their 90 % intervals, each in units of A's value");
}

void add_parameters_of_both(report::HtmlReport& html, const json& parameters) {
  if (parameters.empty()) return;
  html.heading("Parameters");
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, p] : parameters.items()) {
    const std::string verdict = p["apart"].is_null() ? "–" : p["apart"].get<bool>() ? "apart" : "overlap";
    rows.push_back({name, word_text(p["unit"]), parameter_text(p["a"]), parameter_text(p["b"]),
                    signed_text(p["difference"]), number_text(p["ratio"]), verdict});
  }
  html.table({"parameter", "unit", "A (90 %)", "B (90 %)", "B − A", "B / A", "intervals"}, rows);
  add_interval_plot(html, parameters);
}

void add_errors_of_both(report::HtmlReport& html, const json& trials) {
  if (trials.empty()) return;
  html.heading("Error of each trial, mm root mean square");
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, t] : trials.items())
    rows.push_back({name, number_text(t["fitted_mm"]["a"]), number_text(t["fitted_mm"]["b"]),
                    with_interval(t["held_out_mm"]["a"], t["held_out_interval_mm"]["a"]),
                    with_interval(t["held_out_mm"]["b"], t["held_out_interval_mm"]["b"]),
                    signed_text(t["held_out_mm"]["difference"])});
  html.table({"trial", "fitted, A", "fitted, B", "held out, A", "held out, B", "B − A"}, rows);
}

void add_gap_of_both(report::HtmlReport& html, const json& pair) {
  if (!pair.contains("gap")) return;
  html.heading("Gap");
  const json& gap = pair["gap"];
  std::vector<std::vector<std::string>> rows = {
      {"cause", word_text(gap["cause"]["a"]), word_text(gap["cause"]["b"]), ""},
      {"side", word_text(gap["side"]["a"]), word_text(gap["side"]["b"]), ""},
      {"gap above the noise, mm (90 %)", with_interval(gap["value_mm"]["a"], gap["interval_mm"]["a"]),
       with_interval(gap["value_mm"]["b"], gap["interval_mm"]["b"]), signed_text(gap["value_mm"]["difference"])}};
  for (const auto& [key, what] : {std::pair{"held_out_mm", "held-out error, mm"},
                                  {"right_model_mm", "of that a right model would leave, mm"},
                                  {"noise_floor_mm", "the sensor alone, mm"},
                                  {"replicates_mm", "replicates among themselves, mm"},
                                  {"p_value", "p of the gap"}})
    rows.push_back({what, number_text(gap[key]["a"]), number_text(gap[key]["b"]), signed_text(gap[key]["difference"])});
  html.table({"", "A", "B", "B − A"}, rows);
  rows.clear();
  for (const auto& [name, e] : pair["effects"].items()) {
    const bool said = std::max(or_nan(e["probability"]["a"]), or_nan(e["probability"]["b"])) >= 0.005 ||
                      e["closes"]["a"].is_number() || e["closes"]["b"].is_number();
    if (!said) continue;
    rows.push_back({name, percent_text(e["probability"]["a"]), percent_text(e["probability"]["b"]),
                    share_with_interval(e["closes"]["a"], e["closes_interval"]["a"]),
                    share_with_interval(e["closes"]["b"], e["closes_interval"]["b"])});
  }
  html.table({"answer", "probability, A", "probability, B", "share of the gap it closes, A (90 %)", "B (90 %)"}, rows);
  rows.clear();
  for (const json& c : pair["where"])
    rows.push_back({c["axis"], c["cell"], percent_text(c["share"]["a"]), percent_text(c["share"]["b"]),
                    number_text(c["mm"]["a"]), number_text(c["mm"]["b"]), signed_text(c["mm"]["difference"])});
  if (!rows.empty())
    html.table({"axis", "where", "share of the gap, A", "B", "error, A, mm", "error, B, mm", "B − A"}, rows);
}

void add_session_of_both(report::HtmlReport& html, const json& pair) {
  if (!pair.contains("session")) return;
  html.heading("Recording");
  const json &a = pair["session"]["a"], &b = pair["session"]["b"];
  std::vector<std::vector<std::string>> rows;
  for (const auto& [key, what] : {std::pair{"done", "trials recorded"},
                                  {"frames", "frames"},
                                  {"frames_lost", "frames lost"},
                                  {"kept_aside", "attempts kept aside"}})
    rows.push_back(
        {what, number_text(a.is_null() ? json() : a[key], 6), number_text(b.is_null() ? json() : b[key], 6)});
  html.table({"", "A", "B"}, rows);
}

std::string summary_sentence(const json& pair) {
  std::vector<std::string> apart;
  for (const auto& [name, p] : pair["parameters"].items())
    if (p["apart"] == json(true)) apart.push_back(name);
  std::string text;
  if (!pair["parameters"].empty())
    text += apart.empty() ? "No parameter differs beyond its interval. "
                          : fmt::format("Beyond their intervals differ: {}. ", fmt::join(apart, ", "));
  if (pair.contains("gap") && pair["gap"]["cause"]["a"].is_string() && pair["gap"]["cause"]["b"].is_string())
    text += fmt::format("Diagnosis: A {}, B {}.", word_text(pair["gap"]["cause"]["a"]),
                        word_text(pair["gap"]["cause"]["b"]));
  return text;
}

}  // namespace

json write_comparison(const Comparison& comparison, const fs::path& folder) {
  const json summary = to_json(comparison);
  report::HtmlReport html("Two runs side by side");
  html.verdict(report::read_verdict(summary["verdict"]).value_or(report::Verdict{}));
  html.table({"", "folder"},
             {{"A", fs::weakly_canonical(comparison.a).string()}, {"B", fs::weakly_canonical(comparison.b).string()}});
  for (size_t i = 0; i < comparison.pairs.size(); ++i) {
    const ComparedPair& pair = comparison.pairs[i];
    const json& values = summary["pairs"][i];
    html.heading(pair.name);
    if (comparison.pairs.size() > 1) html.verdict(report::read_verdict(values["verdict"]).value_or(report::Verdict{}));
    if (const std::string summary_text = summary_sentence(values); !summary_text.empty()) html.paragraph(summary_text);
    if (values["models"]["a"] != values["models"]["b"])
      html.table({"model", ""}, {{"A", word_text(values["models"]["a"])}, {"B", word_text(values["models"]["b"])}});
    add_parameters_of_both(html, values["parameters"]);
    add_errors_of_both(html, values["trials"]);
    add_gap_of_both(html, values);
    add_figures_of_both(html, pair);
    add_session_of_both(html, values);
  }
  for (const auto& [names, side] : {std::pair{&comparison.only_a, "A"}, {&comparison.only_b, "B"}})
    if (!names->empty()) html.paragraph(fmt::format("In {} alone: {}.", side, fmt::join(*names, ", ")));
  fs::create_directories(folder);
  html.write(folder / "report.html");
  files::write_json(folder / "compare.json", summary);
  return summary;
}

std::string comparison_text(const json& comparison) {
  std::string text;
  if (const auto verdict = report::read_verdict(comparison["verdict"])) text = report::for_terminal(*verdict) + "\n";
  for (const json& pair : comparison["pairs"])
    if (const std::string summary = summary_sentence(pair); !summary.empty())
      text += fmt::format("{}: {}\n", pair["name"].get<std::string>(), summary);
  return text;
}

}  // namespace selvedge::station
