#include "station/comparison_figures.h"

#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "diagnose/fabric_map.h"
#include "files/whole_file.h"
#include "report/plot_data.h"
#include "report/read_figures.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using report::ReadFigure;

// What tells a figure from others of its report: its caption up to what changes from run to run.
std::string figure_key(const ReadFigure& figure) { return figure.caption.substr(0, figure.caption.find(';')); }

// One is drawn anew, on a scale for both.
bool is_fabric_map(const ReadFigure& figure) { return figure.caption.find("on the flat fabric") != std::string::npos; }

void add_fabric_maps_of_both(report::HtmlReport& html, const json& a, const json& b) {
  const auto map_of = [](const json& diagnosis) {
    return diagnosis.is_object() ? diagnose::read_map(diagnosis.value("map", json())) : std::nullopt;
  };
  const auto of_a = map_of(a), of_b = map_of(b);
  if (!of_a || !of_b) {
    html.paragraph(
        fmt::format("No maps of the fabric side by side: the diagnosis of {} was written before Selvedge "
                    "kept what they are drawn from. Diagnose it again.",
                    of_a   ? "B"
                    : of_b ? "A"
                           : "A and of B"));
    return;
  }
  const double end = diagnose::scale_end_mm({&of_a->at_mm, &of_b->at_mm});
  std::vector<std::string> captions;
  for (const auto& [side, map] : {std::pair{"A", &of_a}, {"B", &of_b}})
    captions.push_back(
        fmt::format("{}: error of the base model on the flat fabric, mm ({})", side, diagnose::held_in_words(**map)));
  html.svg_row({diagnose::fabric_map(*of_a, of_a->at_mm, end, captions[0]),
                diagnose::fabric_map(*of_b, of_b->at_mm, end, captions[1])},
               captions);
  html.paragraph(fmt::format("Both maps have one colour scale, 0 to {:g} mm: the same colour is the same error.", end));
}

void add_plots_of_both(report::HtmlReport& html, const std::vector<std::vector<ReadFigure>>& a,
                       const std::vector<std::vector<ReadFigure>>& b) {
  std::map<std::string, const ReadFigure*> of_b;
  for (const auto& row : b)
    for (const ReadFigure& figure : row)
      if (figure.is_svg) of_b[figure_key(figure)] = &figure;
  for (const auto& row : a)
    for (const ReadFigure& figure : row) {
      if (!figure.is_svg || is_fabric_map(figure)) continue;
      const auto found = of_b.find(figure_key(figure));
      if (found == of_b.end()) continue;
      std::pair both = {figure.bytes, found->second->bytes};
      const auto on_a = report::read_plot(both.first), on_b = report::read_plot(both.second);
      if (on_a && on_b) both = report::on_same_axes(*on_a, *on_b);
      html.svg_row({both.first, both.second}, {"A: " + figure.caption, "B: " + found->second->caption});
    }
}

// A fit's report has a row of pictures a frame, its first caption "TRIAL, …"; of five, recorded, simulated and
// difference.
std::map<std::string, std::vector<ReadFigure>> pictures_of_trials(const std::vector<std::vector<ReadFigure>>& rows) {
  std::map<std::string, std::vector<std::vector<ReadFigure>>> of_trial;
  for (const auto& row : rows)
    if (row.size() > 1 && !row[0].is_svg) of_trial[row[0].caption.substr(0, row[0].caption.find(','))].push_back(row);
  std::map<std::string, std::vector<ReadFigure>> chosen;
  for (const auto& [trial, frames] : of_trial) {
    const std::vector<ReadFigure>& row = frames[frames.size() / 2];
    chosen[trial] = row.size() == 5 ? std::vector<ReadFigure>{row[0], row[1], row[4]} : row;
  }
  return chosen;
}

void add_picture_rows(report::HtmlReport& html, const std::vector<ReadFigure>& figures, const char* side) {
  std::vector<std::string> pngs, captions;
  for (const ReadFigure& figure : figures) {
    pngs.push_back(figure.bytes);
    captions.push_back(fmt::format("{}: {}", side, figure.caption));
  }
  html.picture_row(pngs, captions);
}

std::vector<std::vector<ReadFigure>> figures_in(const fs::path& folder, const json& result) {
  if (result.is_null() || !fs::is_regular_file(folder / "report.html")) return {};
  return report::read_figures(files::read_whole(folder / "report.html"));
}

}  // namespace

void add_figures_of_both(report::HtmlReport& html, const ComparedPair& pair) {
  const auto fit_a = figures_in(pair.a.fit_folder, pair.a.fit), fit_b = figures_in(pair.b.fit_folder, pair.b.fit);
  const auto diagnosis_a = figures_in(pair.a.diagnosis_folder, pair.a.diagnosis),
             diagnosis_b = figures_in(pair.b.diagnosis_folder, pair.b.diagnosis);
  const bool both_diagnosed = !pair.a.diagnosis.is_null() && !pair.b.diagnosis.is_null();
  if ((fit_a.empty() || fit_b.empty()) && (diagnosis_a.empty() || diagnosis_b.empty()) && !both_diagnosed) return;
  html.heading("What is left");
  if (both_diagnosed) add_fabric_maps_of_both(html, pair.a.diagnosis, pair.b.diagnosis);
  add_plots_of_both(html, diagnosis_a, diagnosis_b);
  const auto a = pictures_of_trials(fit_a), b = pictures_of_trials(fit_b);
  for (const auto& [trial, figures] : a) {
    const auto found = b.find(trial);
    if (found == b.end()) continue;
    add_picture_rows(html, figures, "A");
    add_picture_rows(html, found->second, "B");
  }
  add_plots_of_both(html, fit_a, fit_b);
}

}  // namespace selvedge::station
