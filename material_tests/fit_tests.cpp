#include "material_tests/fit_tests.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimate/kept_input.h"
#include "files/whole_file.h"
#include "material_tests/cantilever.h"
#include "material_tests/cusick.h"
#include "material_tests/tensile.h"
#include "report/html.h"

namespace selvedge::material_tests {

using nlohmann::json;
using trial::Experiment;
using trial::Trial;

namespace {

struct Kind {
  Experiment experiment;
  Answer (*fit)(const std::vector<const Trial*>&);
};

const Kind kinds[] = {
    {Experiment::cantilever, fit_cantilever},
    {Experiment::cusick, fit_cusick},
    {Experiment::tensile, fit_tensile},
};

// Known to a quarter: as a fit of motion calls a parameter determined.
bool is_determined(const Answer& answer, size_t parameter) {
  const Determined& p = answer.parameters[parameter];
  const auto [low, high] = interval_of(answer, parameter);
  if (p.logarithmic) return high < 1.25 * p.value && low > p.value / 1.25;
  return (high - low) / 2 < 0.25 * (p.unit.empty() ? 1 : std::abs(p.value));
}

json parameters_to_json(const Answer& answer) {
  json out = json::object();
  for (size_t k = 0; k < answer.parameters.size(); ++k) {
    const Determined& p = answer.parameters[k];
    const auto [low, high] = interval_of(answer, k);
    out[p.name] = {
        {"value", p.value},  {"unit", p.unit},   {"interval", {low, high}}, {"determined", is_determined(answer, k)},
        {"at_bound", false}, {"start", p.value}, {"mesh_percent", 0},       {"variability_percent", nullptr}};
  }
  return out;
}

std::string digits(double value) { return fmt::format("{:.4g}", value); }

}  // namespace

std::vector<KindAnswer> fit_tests(const trial::Campaign& tests) {
  std::vector<KindAnswer> out;
  for (const Kind& kind : kinds) {
    KindAnswer of{to_text(kind.experiment), {}, {}};
    std::vector<const Trial*> trials;
    for (const Trial& t : tests.trials) {
      if (t.experiment != kind.experiment) continue;
      trials.push_back(&t);
      of.trials.push_back(t.name);
    }
    if (trials.empty()) continue;
    of.answer = kind.fit(trials);
    out.push_back(std::move(of));
  }
  return out;
}

std::optional<Joined> joined(const std::vector<KindAnswer>& answers, const std::string& parameter) {
  double sum = 0, precision = 0;
  Joined out;
  for (const KindAnswer& of : answers)
    for (size_t k = 0; k < of.answer.parameters.size(); ++k) {
      const Determined& p = of.answer.parameters[k];
      if (p.name != parameter) continue;
      const auto at = static_cast<Eigen::Index>(k);
      const double weight = 1 / std::max(1e-12, of.answer.covariance(at, at));
      sum += weight * (p.logarithmic ? std::log(p.value) : p.value);
      precision += weight;
      out.logarithmic = p.logarithmic;
      out.unit = p.unit;
      out.kinds += (out.kinds.empty() ? "" : " and ") + of.kind;
    }
  if (precision == 0) return std::nullopt;
  out.coordinate = sum / precision;
  out.sd = std::sqrt(1 / precision);
  return out;
}

json to_json(const std::vector<KindAnswer>& answers) {
  json out = json::object();
  for (const KindAnswer& of : answers) {
    json reported = json::object(), errors = json::object();
    for (const Reported& r : of.answer.reported)
      reported[r.name] = {{"value", r.value}, {"unit", r.unit}, {"sd", r.sd}};
    for (const TestError& e : of.answer.errors)
      errors[e.trial] = {{"rms", e.rms}, {"unit", e.unit}, {"samples", e.samples}, {"noise", e.noise}};
    out[of.kind] = {{"trials", of.trials},
                    {"parameters", parameters_to_json(of.answer)},
                    {"reported", reported},
                    {"errors", errors},
                    {"remarks", of.answer.remarks}};
  }
  return out;
}

void add_to_report(report::HtmlReport& html, const std::vector<KindAnswer>& answers) {
  for (const KindAnswer& of : answers) {
    const Answer& a = of.answer;
    html.heading(fmt::format("Material tests: {}", of.kind));
    html.paragraph(fmt::format("Trials: {}.", fmt::join(of.trials, ", ")));
    std::vector<std::vector<std::string>> rows;
    for (size_t k = 0; k < a.parameters.size(); ++k) {
      const auto [low, high] = interval_of(a, k);
      rows.push_back({a.parameters[k].name, digits(a.parameters[k].value), a.parameters[k].unit,
                      fmt::format("{:.3g} … {:.3g}", low, high),
                      is_determined(a, k) ? "determined" : "hardly determined"});
    }
    for (const Reported& r : a.reported)
      rows.push_back({r.name, digits(r.value), r.unit,
                      r.sd > 0 ? fmt::format("{:.3g} … {:.3g}", r.value - 1.645 * r.sd, r.value + 1.645 * r.sd) : "–",
                      "reported"});
    html.table({"", "value", "unit", "90 % interval", ""}, rows);
    for (const std::string& remark : a.remarks) html.paragraph(remark + ".");
    for (const auto& [svg, caption] : a.pictures) html.svg(svg, caption);
    rows.clear();
    for (const TestError& e : a.errors)
      rows.push_back({e.trial, digits(e.rms), e.unit, e.noise > 0 ? digits(e.noise) : "–", std::to_string(e.samples)});
    if (!rows.empty())
      html.table({"measured less simulated", "root mean square", "unit", "of repeated ones", "samples"}, rows);
  }
}

namespace {

// The pictures that trials were taken from, with what was found in them.
void show_found(report::HtmlReport& html, const trial::Campaign& tests) {
  constexpr int kWidth_px = 400;
  bool any = false;
  for (const Trial& t : tests.trials) {
    const std::filesystem::path file = t.folder / "found.png";
    if (!std::filesystem::exists(file)) continue;
    if (!any) html.heading("What was found in the pictures");
    any = true;
    const char* what = t.cusick ? "the outline that was found (red), the support (blue)"
                                : "the strip that was found (red), the table's edge (cross), the tip (ring)";
    html.picture(files::read_whole(file), fmt::format("{}: {}", t.name, what), kWidth_px);
  }
}

}  // namespace

void write_fit_of_tests(const std::vector<KindAnswer>& answers, const trial::Campaign& tests, double wall_s,
                        const std::vector<std::string>& remarks, const std::filesystem::path& folder) {
  json parameters = json::object(), trials = json::object();
  std::vector<std::string> all = remarks;
  for (const KindAnswer& of : answers) {
    parameters.update(parameters_to_json(of.answer));
    for (const TestError& e : of.answer.errors)
      if (e.unit == "mm") trials[e.trial] = {{"error_start", nullptr}, {"error_end", e.rms}, {"frames", e.samples}};
    all.insert(all.end(), of.answer.remarks.begin(), of.answer.remarks.end());
  }
  const std::string name = std::filesystem::weakly_canonical(tests.folder).filename().string();
  report::HtmlReport html("Fit of " + name);
  for (const std::string& remark : remarks) html.paragraph(remark + ".");
  add_to_report(html, answers);
  show_found(html, tests);
  std::filesystem::create_directories(folder);
  html.write(folder / "report.html");
  files::write_json(
      folder / "fit.json",
      {{"format", "fit/1"},
       {"model", "material tests"},
       {"campaign", name},
       {"fabric",
        {{"name", tests.trials.front().fabric.name}, {"areal_mass", trial::areal_mass(tests.trials.front())}}},
       {"parameters", parameters},
       {"trials", trials},
       {"units", "mm root mean square"},
       {"evaluations", 0},
       {"wall_s", wall_s},
       {"remarks", all},
       {"held_out", {{"by", "none"}, {"error", nullptr}}},
       {"optimiser", "least_squares"},
       {"input", estimate::input_hash(estimate::recordings_hash(tests), "material tests")},
       {"material_tests", to_json(answers)}});
}

}  // namespace selvedge::material_tests
