#include "station/session_report.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "diagnose/effects/library.h"
#include "files/whole_file.h"
#include "report/html.h"
#include "report/text_table.h"
#include "station/confirmation.h"
#include "station/json_text.h"
#include "station/session_steps.h"
#include "station/session_verdict.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using report::short_number;

json trials_of(const SwatchPlan& swatch, const fs::path& folder, const json& steps) {
  json trials = json::object();
  std::set<std::string> names;
  for (const session::TrialPlan& trial : swatch.plan.trials) names.insert(trial.name);
  const std::string prefix = swatch.name + "/record/";
  for (const auto& [id, step] : steps.items())
    if (id.rfind(prefix, 0) == 0) names.insert(id.substr(prefix.size()));
  for (const std::string& name : names) {
    const json step = steps.value(prefix + name, json::object());
    json trial = step.value("result", json::object());
    trial["state"] = step.value("state", "not begun");
    if (step.contains("why")) trial["why"] = step["why"];
    json spoiled = json::array();
    for (int k = 1; fs::exists(folder / fmt::format("{}-spoiled-{}", name, k)); ++k)
      spoiled.push_back(fmt::format("{}-spoiled-{}", name, k));
    trial["kept_aside"] = spoiled;
    trials[name] = trial;
  }
  return trials;
}

// Whether the diagnosis names what the swatch really had, or says why it cannot.
json judge_against(const json& truth, const json& diagnosis) {
  const std::string cause = diagnosis.value("cause", "");
  const std::string hidden = truth.contains("hidden") ? truth["hidden"].at("effect").get<std::string>() : "none";
  const auto& library = diagnose::effect_library();
  const bool known = hidden == "none" || std::any_of(library.begin(), library.end(),
                                                     [&](const diagnose::Effect& e) { return e.name == hidden; });
  const std::string right = known ? hidden : "unknown";
  json out = {{"hidden", hidden}, {"right_answer", right}, {"named", cause}, {"names_it", cause == right}};
  if (cause == right) return out;
  const auto lists = [&](const char* key) {
    const json list = diagnosis.value(key, json::array());
    return std::find(list.begin(), list.end(), json(hidden)) != list.end();
  };
  if (lists("cannot_tell"))
    out["why_not"] = "these trials cannot tell: other values of the fitted parameters look the same as " + hidden;
  else if (lists("confusable")) out["why_not"] = hidden + " is among what these trials cannot tell apart";
  else
    out["why_not"] = fmt::format("probability of {} was {}, of {} {}", right,
                                 short_number(diagnosis["probabilities"].value(right, 0.0), 2), cause,
                                 short_number(diagnosis["probabilities"].value(cause, 0.0), 2));
  return out;
}

json fabric_summary(const SwatchPlan& swatch, const fs::path& folder, const json& steps, const json& truth) {
  json out = {{"trials", trials_of(swatch, folder, steps)}};
  if (fs::exists(folder / "fit.json")) {
    const json fit = files::read_json(folder / "fit.json");
    out["fit"] = {
        {"parameters", fit["parameters"]}, {"held_out_mm", fit["held_out"]["error"]}, {"remarks", fit["remarks"]}};
    if (fit.contains("verdict")) out["fit"]["verdict"] = fit["verdict"];
    if (truth.contains("parameters"))
      for (auto& [name, parameter] : out["fit"]["parameters"].items())
        if (truth["parameters"].contains(name)) parameter["truth"] = truth["parameters"][name]["value"];
  }
  const fs::path diagnosis = newest_diagnosis_folder(folder);
  if (fs::exists(diagnosis / "diagnosis.json")) {
    const json d = files::read_json(diagnosis / "diagnosis.json");
    for (const char* key : {"verdict", "cause", "side", "gap", "probabilities", "confusable", "cannot_tell",
                            "effect_size", "shrink", "next_experiment"})
      if (d.contains(key)) out["diagnosis"][key] = d[key];
    out["diagnosis"]["folder"] = diagnosis.filename().string();
    if (const fs::path second = folder / kConfirmationFolder / "confirmation.json"; fs::exists(second))
      out["confirmation"] = files::read_json(second);
    if (!truth.is_null()) out["truth"] = judge_against(truth, d);
  }
  return out;
}

std::string recorded(const json& fabric) {
  const json& trials = fabric["trials"];
  const auto done = std::count_if(trials.begin(), trials.end(), [](const json& t) { return t["state"] == "done"; });
  return fmt::format("{} of {}", done, trials.size());
}

std::string held_out(const json& fabric) {
  return fabric.contains("fit") ? number_text(fabric["fit"]["held_out_mm"]) : "–";
}

std::string answer(const json& fabric) {
  if (!fabric.contains("diagnosis")) return "not diagnosed";
  const json& d = fabric["diagnosis"];
  const std::string cause = d["cause"];
  return fmt::format("{} ({:.0f} %)", cause, 100 * d["probabilities"].value(cause, 0.0));
}

std::string truth_text(const json& fabric) {
  if (!fabric.contains("truth")) return "";
  const json& t = fabric["truth"];
  const std::string hidden = t["hidden"];
  const std::string had = hidden == "none" ? "nothing hidden" : "hidden: " + hidden;
  return t["names_it"].get<bool>()
             ? had + "; the diagnosis is right"
             : fmt::format("{}; the diagnosis says {}: {}", had, t["named"].get<std::string>(), t.value("why_not", ""));
}

void add_answers(report::HtmlReport& html, const json& summary) {
  const bool simulated = std::any_of(summary["fabrics"].begin(), summary["fabrics"].end(),
                                     [](const json& f) { return f.contains("truth"); });
  std::vector<std::string> header = {"fabric",    "trials", "held-out error, mm", "gap, mm",
                                     "diagnosis", "side",   "it closes"};
  if (simulated) header.push_back("what the simulated fabric had");
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, f] : summary["fabrics"].items()) {
    const json d = f.value("diagnosis", json::object());
    const std::string cause = d.value("cause", "");
    const json shrink = d.contains("shrink") && d["shrink"].contains(cause) ? d["shrink"][cause]["fraction"] : json();
    std::vector<std::string> row = {
        name,
        recorded(f),
        held_out(f),
        d.contains("gap") ? number_text(d["gap"]["value_mm"]) : "–",
        answer(f),
        d.value("side", "–"),
        shrink.is_number() ? fmt::format("{:.0f} % of the gap", 100 * shrink.get<double>()) : "–"};
    if (simulated) row.push_back(truth_text(f));
    rows.push_back(row);
  }
  html.table(header, rows);
}

void add_links(report::HtmlReport& html, const json& summary, const fs::path& folder) {
  for (const auto& [name, f] : summary["fabrics"].items()) {
    std::vector<std::pair<std::string, std::string>> links;
    if (f.contains("fit")) links.emplace_back(name + ": its fit", name + "/report.html");
    if (f.contains("diagnosis"))
      links.emplace_back("its diagnosis",
                         fmt::format("{}/{}/report.html", name, f["diagnosis"]["folder"].get<std::string>()));
    if (fs::exists(folder / name / "calibration" / "report.html"))
      links.emplace_back("its calibration", name + "/calibration/report.html");
    if (f.contains("confirmation"))
      links.emplace_back("its second session", fmt::format("{}/{}/report.html", name, kConfirmationFolder));
    if (!links.empty()) html.links(links);
  }
  if (fs::exists(folder / "calibration" / "report.html"))
    html.links({{"calibration of camera and projector", "calibration/report.html"}});
}

// First frame in motion of a waved or robot trial of each fabric.
void add_pictures(report::HtmlReport& html, const SessionFile& file, const fs::path& folder) {
  std::vector<std::string> pngs, captions;
  for (const SwatchPlan& swatch : file.fabrics)
    for (const session::TrialPlan& trial : swatch.plan.trials) {
      const fs::path frames = folder / swatch.name / trial.name / "frames";
      if (trial.kind == trial::Experiment::static_hang || !fs::is_directory(frames)) continue;
      std::vector<fs::path> pictures;
      for (const auto& entry : fs::directory_iterator(frames)) pictures.push_back(entry.path());
      if (pictures.empty()) continue;
      std::sort(pictures.begin(), pictures.end());
      pngs.push_back(files::read_whole(pictures[pictures.size() / 2]));
      captions.push_back(fmt::format("{}, {}", swatch.name, trial.name));
      break;
    }
  if (pngs.empty()) return;
  html.heading("Side by side");
  html.picture_row(pngs, captions);
}

void add_parameters(report::HtmlReport& html, const json& summary) {
  std::set<std::string> names;
  std::vector<std::string> header = {"parameter", "unit"};
  for (const auto& [fabric, f] : summary["fabrics"].items()) {
    if (!f.contains("fit")) continue;
    header.push_back(fabric + " (90 %)");
    for (const auto& [name, parameter] : f["fit"]["parameters"].items()) names.insert(name);
  }
  if (names.empty()) return;
  html.heading("What was fitted");
  std::vector<std::vector<std::string>> rows;
  for (const std::string& name : names) {
    std::vector<std::string> row = {name, ""};
    for (const auto& [fabric, f] : summary["fabrics"].items()) {
      if (!f.contains("fit")) continue;
      const json p = f["fit"]["parameters"].value(name, json());
      if (p.is_null()) {
        row.push_back("–");
        continue;
      }
      row[1] = p["unit"];
      row.push_back(fmt::format("{} ({} … {}){}{}", number_text(p["value"]), number_text(p["interval"][0]),
                                number_text(p["interval"][1]), p["determined"].get<bool>() ? "" : ", hardly determined",
                                p.contains("truth") ? fmt::format("; simulated {}", number_text(p["truth"])) : ""));
    }
    rows.push_back(row);
  }
  html.table(header, rows);
}

void add_trials(report::HtmlReport& html, const json& summary) {
  html.heading("Trials and their checks");
  std::vector<std::vector<std::string>> rows;
  for (const auto& [fabric, f] : summary["fabrics"].items())
    for (const auto& [name, t] : f["trials"].items())
      rows.push_back(
          {fabric, name, t["state"], number_text(t.value("frames", json()), 6),
           number_text(t.value("frames_lost", json()), 6),
           t.contains("occluded_share") ? fmt::format("{:.1f} %", 100 * t["occluded_share"].get<double>()) : "–",
           t.contains("started_at_rest") ? (t["started_at_rest"].get<bool>() ? "yes" : "no") : "–",
           std::to_string(t["kept_aside"].size()), t.value("why", "")});
  html.table({"fabric", "trial", "state", "frames", "lost", "corner hidden", "began at rest", "attempts kept aside",
              "last failure"},
             rows);
}

void add_steps(report::HtmlReport& html, const json& summary) {
  html.heading("Steps");
  std::vector<std::vector<std::string>> rows;
  for (const json& s : summary["steps_in_order"]) {
    const json& step = summary["steps"][s.get<std::string>()];
    rows.push_back(
        {s, step["state"], number_text(step["attempts"], 6), number_text(step["seconds"], 4), step.value("why", "")});
  }
  html.table({"step", "state", "attempts", "s", "last failure"}, rows);
}

json session_summary(const SessionFile& file, const fs::path& folder) {
  json steps = json::object();
  for (const auto& [id, record] : read_journal(folder)) {
    steps[id] = {{"state", to_text(record.state)}, {"attempts", record.attempts}, {"seconds", record.seconds}};
    if (!record.why.empty()) steps[id]["why"] = record.why;
    if (!record.result.is_null()) steps[id]["result"] = record.result;
  }
  json order = json::array();
  std::set<std::string> listed;
  for (const Step& step : planned_steps(file))
    if (steps.contains(step.id(file)) && listed.insert(step.id(file)).second) order.push_back(step.id(file));
  for (const auto& [id, step] : steps.items())
    if (listed.insert(id).second) order.push_back(id);
  const json truth = fs::exists(folder / "truth.json") ? files::read_json(folder / "truth.json") : json();
  json out = {{"format", "session/1"},
              {"file", file.path.filename().string()},
              {"steps", steps},
              {"steps_in_order", order},
              {"fabrics", json::object()}};
  if (steps.contains("calibrate")) out["calibration"] = steps["calibrate"].value("result", json::object());
  for (const SwatchPlan& swatch : file.fabrics) {
    const json known =
        truth.is_object() && truth.contains("swatches") ? truth["swatches"].value(swatch.name, json()) : json();
    out["fabrics"][swatch.name] = fabric_summary(swatch, folder / swatch.name, steps, known);
  }
  out["verdict"] = report::to_json(verdict_of_session(out));
  return out;
}

}  // namespace

json write_session_report(const SessionFile& file, const fs::path& folder) {
  const json summary = session_summary(file, folder);
  report::HtmlReport html("Session " + file.path.stem().string());
  html.verdict(verdict_of_session(summary));
  add_answers(html, summary);
  add_links(html, summary, folder);
  add_pictures(html, file, folder);
  add_parameters(html, summary);
  add_trials(html, summary);
  add_steps(html, summary);
  html.links({{"all of it as JSON", "session.json"}});
  html.write(folder / "report.html");
  files::write_json(folder / "session.json", summary);
  return summary;
}

std::string session_text(const json& summary) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, f] : summary["fabrics"].items()) {
    rows.push_back({name, recorded(f), held_out(f), answer(f), truth_text(f)});
  }
  return report::for_terminal(verdict_of_session(summary)) + "\n" +
         report::text_table({"fabric", "trials", "held out, mm", "diagnosis", ""}, rows);
}

}  // namespace selvedge::station
