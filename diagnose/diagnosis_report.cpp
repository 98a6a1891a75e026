#include "diagnose/diagnosis_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "diagnose/diagnosis_verdict.h"
#include "diagnose/diagnosis_words.h"
#include "diagnose/fabric_map.h"
#include "diagnose/simulator_report.h"
#include "diagnose/where_report.h"
#include "files/whole_file.h"
#include "report/html.h"

namespace selvedge::diagnose {

namespace {

using nlohmann::json;

json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json reduction_json(const Diagnosis& d, const GapReduction& s) {
  json out = {{"held_out_before_mm", number(s.before_mm)},
              {"held_out_after_mm", number(s.after_mm)},
              {"fraction", number(s.fraction)},
              {"interval", {number(s.low), number(s.high)}}};
  if (d.is_ahead) out["ahead_s"] = d.protocol.free_s;
  return out;
}

// What the base leaves, falling effect by effect to what nothing explains and the sensor: shares of the squared error.
std::string waterfall(const Diagnosis& d) {
  constexpr double kWidth = 640, kBar = 26, kLeft = 170, kRight = 90;
  const double whole = d.budget.total_mm * d.budget.total_mm, noise = d.budget.noise_mm * d.budget.noise_mm,
               gap = std::max(0.0, whole - noise), scale = whole > 0 ? (kWidth - kLeft - kRight) / whole : 0;
  struct Bar {
    std::string name, text, colour;
    double from, to;
  };
  std::vector<Bar> bars = {{"the base leaves", fmt::format("{:.2f} mm", d.budget.total_mm), "#607080", 0, whole}};
  double at = whole;
  for (const BudgetPart& p : d.budget.parts) {
    const double to = at - p.share.value * gap;
    bars.push_back({p.effect, percent(p.share.value), "#2a7ab0", std::min(at, to), std::max(at, to)});
    at = to;
  }
  bars.push_back(
      {"nothing explains", percent(d.budget.unexplained.value), "#b05a2a", std::min(noise, at), std::max(noise, at)});
  bars.push_back({"the sensor", fmt::format("{:.2f} mm", d.budget.noise_mm), "#a0a8b0", 0, noise});
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {:.0f} {:.0f}' width='{:.0f}' role='img' aria-label='What "
      "each effect takes of the gap'>",
      kWidth, kBar * static_cast<double>(bars.size()), kWidth);
  for (size_t i = 0; i < bars.size(); ++i) {
    const double y = kBar * static_cast<double>(i), x = kLeft + scale * std::max(0.0, bars[i].from),
                 width = std::max(1.5, scale * (bars[i].to - std::max(0.0, bars[i].from)));
    svg += fmt::format(
        "<text x='{:.0f}' y='{:.0f}' text-anchor='end' font-size='13' fill='currentColor'>{}</text><rect x='{:.1f}' "
        "y='{:.0f}' width='{:.1f}' height='{:.0f}' fill='{}'/><text x='{:.1f}' y='{:.0f}' font-size='13' "
        "fill='currentColor'>{}</text>",
        kLeft - 8, y + 0.68 * kBar, bars[i].name, x, y + 4, width, kBar - 8, bars[i].colour, x + width + 6,
        y + 0.68 * kBar, bars[i].text);
  }
  return svg + "</svg>";
}

void add_budget(report::HtmlReport& html, const Diagnosis& d) {
  html.heading("What takes how much of the gap");
  html.svg(
      waterfall(d),
      "Shares of the squared error of held-out trials: what the base leaves, what each effect of the likeliest set "
      "takes, what nothing explains, and what the sensor alone leaves");
  std::vector<std::vector<std::string>> rows;
  for (const BudgetPart& p : d.budget.parts)
    rows.push_back({p.effect, fmt::format("{:.3f}", p.probability), percent(p.share)});
  rows.push_back({"nothing explains", "", percent(d.budget.unexplained)});
  html.table({"part", "probability that it is there", "share of the gap (90 %)"}, rows);
  rows.clear();
  for (const WeighedSet& s : d.sets)
    rows.push_back({s.name + (s.and_unknown ? " and something unknown" : ""), fmt::format("{:.3f}", s.probability),
                    fmt::format("{:.2f}", s.model_error)});
  html.table({"set of effects", "probability", "what the model itself must be off by (1: as right models usually are)"},
             rows);
}

void add_replay(report::HtmlReport& html, const Diagnosis& d) {
  if (d.replay.empty()) return;
  html.heading("In motion");
  html.interactive(
      report::moving_sheets(d.replay, "missing force", "N/m²"),
      fmt::format(
          "Dots: where markers, or points of the surface, were recorded; lines: from markers to where the model has "
          "them, in trials that it was not fitted to (blue: none off, red: 4 mm and more). Arrows: the force that the "
          "model still lacks; faint where it is less than two standard deviations. {}Drag or press the arrow keys to "
          "turn, turn the wheel or press + to come nearer.",
          d.is_ahead ? fmt::format("The sheet is held near the markers, then predicted for {:g} s, and so on. ",
                                   d.protocol.free_s)
                     : ""));
}

void add_effects(report::HtmlReport& html, const Diagnosis& d) {
  html.heading("Which effect");
  std::vector<std::vector<std::string>> rows;
  for (const EffectFinding& f : d.effects) {
    const std::string size = in_words(f.size);
    rows.push_back({name_in_words(f), to_text(f.side), fmt::format("{:.3f}", f.inclusion),
                    fmt::format("{:.3f}", f.probability), percent(f.absorbed),
                    f.weighed ? before_and_after(f.reduction) : "–", f.weighed ? share_closed(f.reduction) : "–",
                    size.empty() ? "–" : size});
  }
  html.table({"effect", "side", "probability that it is there", "probability as the cause",
              "hidden by refitting the base model", "error of the base, and with it, mm",
              "share of the gap it closes (90 %)", "size (90 %)"},
             rows);
  html.paragraph(no_effect_in_words(d));
  if (!d.forecast.motion.empty())
    html.paragraph(
        fmt::format("Forecast of a motion that is not recorded yet: in {}, the base model will be {:.1f} mm off{}, and "
                    "{:.1f} mm with {}.",
                    motion_in_words(d.forecast.motion, d.forecast.moving_s), d.forecast.before_mm,
                    interval_in_words(d.forecast.low_mm, d.forecast.high_mm, 1), d.forecast.after_mm, d.likeliest));
  if (!d.cannot_tell.empty()) {
    std::string names;
    for (const std::string& name : d.cannot_tell) names += (names.empty() ? "" : ", ") + name;
    html.paragraph("These trials could not show these effects even at their usual size: " + names + ".");
  }
  rows.clear();
  for (const EffectFinding& f : d.effects)
    if (f.inclusion <= 0.5) rows.push_back({f.name, unseen_in_words(f)});
  html.table({"effect that is not named", "may be there unseen (90 %)"}, rows);
}

void add_parameters(report::HtmlReport& html, const Diagnosis& d) {
  html.heading("Parameters of the model");
  const bool named = d.cause != "none" && d.cause != "unknown";
  std::vector<std::vector<std::string>> rows;
  for (const BaseParameter& p : d.parameters)
    rows.push_back({p.name, p.unit, fmt::format("{:.4g}", p.value), named ? fmt::format("{:.4g}", p.corrected) : "–",
                    named ? fmt::format("{:+.0f} %", 100 * (p.value / p.corrected - 1)) : "–"});
  html.table(
      {"parameter", "unit", "base fit", named ? "with " + d.likeliest : "with the cause", "bias of the base fit"},
      rows);
}

}  // namespace

json to_json(const Diagnosis& d) {
  json sides = json::object(), where = json::array(), sizes = json::object(), shrink = json::object(),
       at_most = json::object(), parameters = json::object(), screened = json::object(), parts = json::array(),
       sets = json::array();
  for (const EffectFinding& f : d.effects) sides[f.name] = to_text(f.side);
  for (const Cell& c : d.where)
    where.push_back({{"axis", c.axis}, {"cell", c.cell}, {"share", c.share}, {"mm", c.mm}, {"p_value", c.p_value}});
  for (const EffectFinding& f : d.effects) {
    screened[f.name] = {{"absorbed", f.absorbed}, {"gain", f.screened_gain}};
    for (const SizedParameter& p : f.at_most)
      at_most[f.name][p.name] = {{"unit", p.unit}, {"interval", {p.low, p.high}}};
    if (!f.weighed) continue;
    for (const SizedParameter& p : f.size)
      sizes[f.name][p.name] = {{"value", p.value}, {"unit", p.unit}, {"interval", {p.low, p.high}}};
    shrink[f.name] = reduction_json(d, f.reduction);
    if (!f.beside.empty()) shrink[f.name]["beside"] = f.beside;
  }
  for (const BaseParameter& p : d.parameters)
    parameters[p.name] = {{"base", p.value}, {"corrected", p.corrected}, {"unit", p.unit}};
  for (const BudgetPart& p : d.budget.parts) {
    json part = to_json(p.share);
    part["effects"] = {p.effect};
    part["probability"] = p.probability;
    parts.push_back(part);
  }
  for (const WeighedSet& s : d.sets)
    sets.push_back({{"effects", s.name},
                    {"and_unknown", s.and_unknown},
                    {"probability", s.probability},
                    {"model_error", s.model_error}});
  json out = {{"format", "diagnosis/1"},
              {"verdict", report::to_json(verdict_of(d))},
              {"campaign", d.campaign},
              {"gap",
               {{"value_mm", d.gap_mm},
                {"noise_floor_mm", d.noise_floor_mm},
                {"interval_mm", {number(d.low_mm), number(d.high_mm)}},
                {"p_value", d.p_value},
                {"held_out_mm", d.before_mm},
                {"right_model_mm", d.right_floor_mm}}},
              {"where", where},
              {"map", map_to_json(d.map)},
              {"side", d.side},
              {"cause", d.cause},
              {"probabilities", d.probability},
              {"inclusion", d.inclusion},
              {"budget",
               {{"total_mm", d.budget.total_mm},
                {"measurement", {{"noise_mm", d.budget.noise_mm}}},
                {"parts", parts},
                {"unexplained", to_json(d.budget.unexplained)}}},
              {"sets", sets},
              {"missing_force", "missing_force.json"},
              {"confusable", d.confusable},
              {"effect_size", sizes},
              {"shrink", shrink},
              {"next_experiment", {{"separates", d.separates}, {"do", d.next_experiment}}},
              {"base", d.base},
              {"likeliest", d.likeliest},
              {"parameters", parameters},
              {"cannot_tell", d.cannot_tell},
              {"size_at_most", at_most},
              {"screened", screened},
              {"fit", d.fit},
              {"sides", sides},
              {"remarks", d.remarks},
              {"grid_cells", {d.cells, d.fine_cells}},
              {"evaluations", d.evaluations},
              {"cpu_s", d.cpu_s},
              {"wall_s", d.wall_s}};
  if (!d.other.name.empty()) out["simulator"] = to_json(d.other);
  if (d.is_ahead) out["gap"]["ahead_s"] = d.protocol.free_s;
  if (!d.forecast.motion.empty())
    out["forecast"] = {
        {"motion", d.forecast.motion},       {"like_trial", d.forecast.like_trial},
        {"speed", d.forecast.speed},         {"moving_s", number(d.forecast.moving_s)},
        {"before_mm", d.forecast.before_mm}, {"interval_mm", {number(d.forecast.low_mm), number(d.forecast.high_mm)}},
        {"after_mm", d.forecast.after_mm}};
  return out;
}

void write_diagnosis(const Diagnosis& d, const std::filesystem::path& folder) {
  report::HtmlReport html("Diagnosis of " + d.campaign);
  html.verdict(verdict_of(d));
  html.input(d.input);
  html.paragraph(fmt::format("{} What to do next: {}.", gap_in_words(d), d.next_experiment));
  add_simulator_gap(html, d.other);
  add_budget(html, d);
  add_replay(html, d);
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
  files::write_json(folder / "missing_force.json", to_json(d.missing_force));
  files::write_json(folder / "diagnosis.json", to_json(d));
}

}  // namespace selvedge::diagnose
