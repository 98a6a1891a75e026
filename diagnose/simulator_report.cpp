#include "diagnose/simulator_report.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace selvedge::diagnose {

using nlohmann::json;

namespace {

constexpr double kImitates = 0.5;  // of its gap, that our sheet may be off its motion

std::string parameters_in_words(const SimulatorPart& p) {
  std::string out;
  for (const BehavesAs& b : p.parameters)
    out += fmt::format("{}{} {:.3g} beside {:.3g} {}", out.empty() ? "" : "; ", b.name, b.simulator, b.fabric, b.unit);
  return out.empty() ? "it has none" : out;
}

}  // namespace

std::vector<std::string> lines_of(const SimulatorGap& g) {
  if (g.diverged)
    return {fmt::format("Our sheet diverges where it behaves as {}: what that lacks is not told.", g.name)};
  std::vector<std::string> out = {
      fmt::format("Our sheet, behaving as {}, leaves {:.2f} mm of the recording; with all that the fabric has, {:.2f} "
                  "mm. Of {}'s own motion it leaves {:.2f} mm: so much it cannot imitate.",
                  g.name, g.before_mm, g.after_mm, g.name, g.imitated_mm)};
  std::string most;
  double share = 0;
  for (const SimulatorPart& p : g.parts)
    if (p.share.value > share) {
      share = p.share.value;
      most = fmt::format("Most of its gap, {}, is {}: put right alone, {:.2f} mm are left.", percent(p.share), p.name,
                         p.alone_mm);
    }
  if (!most.empty()) out.push_back(most);
  if (g.imitated_mm > kImitates * g.before_mm)
    out.push_back("Its motion is too unlike our sheet's for these parts to be believed.");
  return out;
}

json to_json(const SimulatorGap& g) {
  json parts = json::array();
  for (const SimulatorPart& p : g.parts) {
    json part = to_json(p.share);
    part["part"] = p.name;
    part["alone_mm"] = p.alone_mm;
    for (const BehavesAs& b : p.parameters)
      part["parameters"][b.name] = {{"simulator", b.simulator}, {"fabric", b.fabric}, {"unit", b.unit}};
    parts.push_back(part);
  }
  return {{"name", g.name},         {"is", g.identity},
          {"diverged", g.diverged}, {"before_mm", g.before_mm},
          {"after_mm", g.after_mm}, {"imitated_mm", g.imitated_mm},
          {"parts", parts},         {"unexplained", to_json(g.unexplained)}};
}

void add_simulator_gap(report::HtmlReport& html, const SimulatorGap& g) {
  if (g.name.empty()) return;
  html.heading("What " + g.name + " lacks");
  for (const std::string& line : lines_of(g)) html.paragraph(line);
  std::vector<std::vector<std::string>> rows;
  for (const SimulatorPart& p : g.parts)
    rows.push_back({p.name, parameters_in_words(p), percent(p.share), fmt::format("{:.2f}", p.alone_mm)});
  html.table({"part", "it beside the fabric", "share of its gap (90 %)", "left where this alone is put right, mm"},
             rows);
}

}  // namespace selvedge::diagnose
