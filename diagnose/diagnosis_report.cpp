#include "diagnose/diagnosis_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "diagnose/ahead.h"
#include "diagnose/fabric_map.h"
#include "files/whole_file.h"
#include "report/html.h"

namespace selvedge::diagnose {

namespace {

using nlohmann::json;

json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json reduction_json(const GapReduction& s, const Protocol& protocol) {
  json out = {{"held_out_before_mm", number(s.before_mm)},
              {"held_out_after_mm", number(s.after_mm)},
              {"fraction", number(s.fraction)},
              {"interval", {number(s.low), number(s.high)}}};
  if (s.is_ahead) out["ahead_s"] = protocol.ahead_s;
  return out;
}

std::string percent(double share) { return fmt::format("{:.0f} %", 100 * share); }

std::string answer_in_words(const Diagnosis& d) {
  const std::string sizes = fmt::format(
      "The base model ({}) predicts held-out trials to {:.2f} mm; the sensor alone leaves {:.2f} mm, a right model "
      "about {:.2f} mm.",
      d.base, d.before_mm, d.noise_floor_mm, d.right_floor_mm);
  const double p = d.probability.at(d.cause);
  if (d.cause == "none") return fmt::format("No effect is needed (probability {}). {}", percent(p), sizes);
  if (!d.pair.empty())
    return fmt::format(
        "There is a gap, and no single effect of the library closes it; consistent with two at once: {} (probability "
        "{}). Added to the model they take the error of held-out trials{} from {:.2f} to {:.2f} mm, {} of the gap. {}",
        d.pair, percent(d.pair_probability),
        d.pair_reduction.is_ahead ? fmt::format(", predicted {:g} s ahead,", d.protocol.ahead_s) : "",
        d.pair_reduction.before_mm, d.pair_reduction.after_mm, percent(d.pair_reduction.fraction), sizes);
  if (d.cause == "unknown")
    return fmt::format("There is a gap, and no effect of the library closes it: unknown (probability {}). {}",
                       percent(p), sizes);
  for (const EffectFinding& f : d.effects)
    if (f.name == d.cause)
      return fmt::format(
          "Consistent with {}: {} (probability {}, {} side). Added to the model it takes the error of held-out "
          "trials{} from {:.2f} to {:.2f} mm, {} of the gap{}. {}",
          f.name, f.summary, percent(p), d.side,
          f.reduction.is_ahead ? fmt::format(", predicted {:g} s ahead,", d.protocol.ahead_s) : "",
          f.reduction.before_mm, f.reduction.after_mm, percent(f.reduction.fraction),
          f.reduction.is_ahead
              ? fmt::format("; that of whole motions from {:.2f} to {:.2f} mm, {}", f.free_reduction.before_mm,
                            f.free_reduction.after_mm, percent(f.free_reduction.fraction))
              : "",
          sizes);
  return sizes;
}

void add_effects(report::HtmlReport& html, const Diagnosis& d) {
  html.heading("Which effect");
  std::vector<std::vector<std::string>> rows;
  for (const EffectFinding& f : d.effects) {
    std::string size;
    for (const SizedParameter& p : f.size)
      size += fmt::format("{}{} {:.3g} {} ({:.3g} … {:.3g})", size.empty() ? "" : "; ", p.name, p.value, p.unit, p.low,
                          p.high);
    rows.push_back({f.name, to_text(f.side), fmt::format("{:.3f}", f.probability), percent(f.absorbed),
                    percent(f.screened_gain), f.reduction.is_ahead ? before_and_after(f.reduction) : "–",
                    f.finalist ? share_closed(f.reduction) : "–", f.finalist ? before_and_after(f.free_reduction) : "–",
                    size.empty() ? "–" : size});
  }
  html.table({"effect", "side", "probability", "absorbed by refitting the base", "explains of the rest, linearly",
              fmt::format("error of predictions {:g} s ahead, mm", d.protocol.ahead_s),
              "share of the gap it closes (90 %)", "error of whole motions, mm", "size (90 %)"},
             rows);
  html.paragraph(fmt::format("none {:.3f}, unknown {:.3f}. Held-out error without any: {:.2f} mm.",
                             d.probability.at("none"), d.probability.at("unknown"), d.before_mm));
  if (!d.forecast.motion.empty())
    html.paragraph(fmt::format(
        "Forecast, not recorded yet: in {} the base model will be {:.1f} mm off (90 % {:.1f} … {:.1f}), with {} {:.1f} "
        "mm.",
        d.forecast.motion, d.forecast.before_mm, d.forecast.low_mm, d.forecast.high_mm, d.cause, d.forecast.after_mm));
  if (!d.pair.empty())
    html.paragraph(fmt::format(
        "Two effects predict better than one: {} (probability {}, which the two share above) takes the "
        "held-out error to {:.2f} mm, {} of the gap.",
        d.pair, percent(d.pair_probability), d.pair_reduction.after_mm, percent(d.pair_reduction.fraction)));
  if (!d.cannot_tell.empty()) {
    std::string names;
    for (const std::string& name : d.cannot_tell) names += (names.empty() ? "" : ", ") + name;
    html.paragraph("These data cannot tell, because refitting the base model absorbs it: " + names + ".");
  }
}

void add_where(report::HtmlReport& html, const Diagnosis& d) {
  html.heading("Where");
  if (!d.map.uv.empty())
    html.svg(fabric_map(d.map),
             "Held-out error of the base model at each marker, or about each spot that stripes and outline showed, mm, "
             "on the flat fabric; the top edge is held");
  std::vector<report::Series> series;
  for (const auto& t : d.map.over_time) series.push_back({t.trial, t.time_s, t.mm});
  report::PlotOptions plot;
  plot.x_label = "time, s";
  plot.y_label = "error, mm";
  plot.height_px = 240;
  if (!series.empty())
    html.svg(report::line_plot(series, plot),
             "Over time: held-out error of the base model, each trial predicted from the others");
  plot.x_label = "frequency, Hz";
  if (!d.map.frequency_hz.empty())
    html.svg(report::line_plot({{"residual", d.map.frequency_hz, d.map.frequency_mm}}, plot),
             "Over frequency: amplitude of the residual per bin");
  plot.x_label = "camera row, px";
  if (!d.map.image_row_px.empty())
    html.svg(report::line_plot({{"residual", d.map.image_row_px, d.map.image_mm}}, plot),
             "Over the image: by the camera row at which the point is seen");
  std::vector<std::vector<std::string>> rows;
  for (const Cell& c : d.where)
    rows.push_back({c.axis, c.cell, percent(c.share), fmt::format("{:.2f}", c.mm), fmt::format("{:.3f}", c.p_value),
                    c.p_value < 0.05 ? "stands out" : ""});
  html.table({"axis", "cell", "share of the gap", "error, mm", "p, corrected", ""}, rows);
}

void add_parameters(report::HtmlReport& html, const Diagnosis& d) {
  html.heading("Parameters of the model");
  const bool named = d.cause != "none" && d.cause != "unknown";
  std::vector<std::vector<std::string>> rows;
  for (const BaseParameter& p : d.parameters)
    rows.push_back({p.name, p.unit, fmt::format("{:.4g}", p.value), named ? fmt::format("{:.4g}", p.corrected) : "–",
                    named ? fmt::format("{:+.0f} %", 100 * (p.value / p.corrected - 1)) : "–"});
  html.table({"parameter", "unit", "base fit", named ? "with " + (d.pair.empty() ? d.cause : d.pair) : "with the cause",
              "bias of the base fit"},
             rows);
}

}  // namespace

std::string before_and_after(const GapReduction& s) { return fmt::format("{:.2f} → {:.2f}", s.before_mm, s.after_mm); }

std::string share_closed(const GapReduction& s) {
  return std::isfinite(s.low) ? fmt::format("{:.2f} ({:.2f} … {:.2f})", s.fraction, s.low, s.high)
                              : fmt::format("{:.2f}", s.fraction);
}

json to_json(const Diagnosis& d) {
  json sides = json::object();
  for (const EffectFinding& f : d.effects) sides[f.name] = to_text(f.side);
  json where = json::array(), sizes = json::object(), shrink = json::object(), parameters = json::object(),
       screened = json::object();
  for (const Cell& c : d.where)
    where.push_back({{"axis", c.axis}, {"cell", c.cell}, {"share", c.share}, {"mm", c.mm}, {"p_value", c.p_value}});
  for (const EffectFinding& f : d.effects) {
    screened[f.name] = {{"absorbed", f.absorbed}, {"gain", f.screened_gain}};
    if (!f.finalist) continue;
    for (const SizedParameter& p : f.size)
      sizes[f.name][p.name] = {{"value", p.value}, {"unit", p.unit}, {"interval", {p.low, p.high}}};
    shrink[f.name] = reduction_json(f.reduction, d.protocol);
    shrink[f.name]["free"] = reduction_json(f.free_reduction, d.protocol);
  }
  for (const BaseParameter& p : d.parameters)
    parameters[p.name] = {{"base", p.value}, {"corrected", p.corrected}, {"unit", p.unit}};
  json out = {{"format", "diagnosis/1"},
              {"campaign", d.campaign},
              {"gap",
               {{"value_mm", d.gap_mm},
                {"noise_floor_mm", d.noise_floor_mm},
                {"interval_mm", {d.low_mm, d.high_mm}},
                {"p_value", d.p_value},
                {"held_out_mm", d.before_mm},
                {"right_model_mm", d.right_floor_mm}}},
              {"where", where},
              {"side", d.side},
              {"cause", d.cause},
              {"probabilities", d.probability},
              {"confusable", d.confusable},
              {"effect_size", sizes},
              {"shrink", shrink},
              {"next_experiment", {{"separates", d.separates}, {"do", d.next_experiment}}},
              {"base", d.base},
              {"parameters", parameters},
              {"cannot_tell", d.cannot_tell},
              {"screened", screened},
              {"judged",
               {{"groups", d.judged.groups},
                {"noise_mm", d.judged.noise},
                {"right_model_mm", d.judged.right_model},
                {"left_mm", d.judged.left}}},
              {"fit", d.fit},
              {"free_fit", d.free_fit},
              {"sides", sides},
              {"remarks", d.remarks},
              {"grid_cells", {d.cells, d.fine_cells}},
              {"evaluations", d.evaluations},
              {"cpu_s", d.cpu_s},
              {"wall_s", d.wall_s}};
  if (std::isfinite(d.replicate_mm)) out["gap"]["replicates_mm"] = d.replicate_mm;
  if (!d.forecast.motion.empty())
    out["forecast"] = {{"motion", d.forecast.motion},
                       {"before_mm", d.forecast.before_mm},
                       {"interval_mm", {d.forecast.low_mm, d.forecast.high_mm}},
                       {"after_mm", d.forecast.after_mm}};
  if (!d.pair.empty()) {
    out["pair"] = reduction_json(d.pair_reduction, d.protocol);
    out["pair"]["effects"] = d.pair;
    out["pair"]["probability"] = d.pair_probability;
  }
  return out;
}

void write_diagnosis(const Diagnosis& d, const std::filesystem::path& folder) {
  report::HtmlReport html("Diagnosis of " + d.campaign);
  html.paragraph(answer_in_words(d));
  html.paragraph(
      fmt::format("Gap {:.2f} mm above the noise floor (90 % {:.2f} … {:.2f}), p {:.3g} against campaigns that lack "
                  "nothing. Next: {}.",
                  d.gap_mm, d.low_mm, d.high_mm, d.p_value, d.next_experiment));
  add_effects(html, d);
  add_where(html, d);
  add_parameters(html, d);
  for (const std::string& remark : d.remarks) html.paragraph(remark + ".");
  html.heading("Work");
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, seconds] : d.stage_s) rows.push_back({name, fmt::format("{:.1f}", seconds)});
  html.table({"stage", "s"}, rows);
  html.paragraph(fmt::format("{} simulations of the campaign, {:.0f} s of processor time.", d.evaluations, d.cpu_s));
  std::filesystem::create_directories(folder);
  html.write(folder / "report.html");
  if (!d.next_session.empty()) files::write_whole(folder / "next_session.toml", d.next_session);
  else std::filesystem::remove(folder / "next_session.toml");  // of an earlier run
  files::write_json(folder / "diagnosis.json", to_json(d));
}

}  // namespace selvedge::diagnose
