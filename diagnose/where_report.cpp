#include "diagnose/where_report.h"

#include <fmt/format.h>

#include "diagnose/fabric_map.h"

namespace selvedge::diagnose {

namespace {

// Before and after on one scale.
void add_fabric_maps(report::HtmlReport& html, const Diagnosis& d) {
  if (d.map.uv.empty()) return;
  const double end = scale_end_mm({&d.map.at_mm, &d.map.after_mm});
  std::vector<std::string> pictures, captions;
  const auto add = [&](const std::vector<double>& mm, const std::string& of) {
    captions.push_back(fmt::format("Error of {} on the flat fabric, mm, in trials it was not fitted to ({})", of,
                                   held_in_words(d.map)));
    pictures.push_back(fabric_map(d.map, mm, end, captions.back()));
  };
  add(d.map.at_mm, "the base model");
  if (!d.map.after_mm.empty()) add(d.map.after_mm, "the model with " + d.likeliest);
  html.svg_row(pictures, captions);
  html.paragraph(
      fmt::format("Each number is the error at one marker, or about one spot that stripes, a scan or the outline "
                  "showed. Black: where the fabric is held. One colour scale, 0 to {:g} mm, for all that is "
                  "shown here.",
                  end));
}

}  // namespace

void add_where(report::HtmlReport& html, const Diagnosis& d) {
  html.heading("Where");
  add_fabric_maps(html, d);
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

}  // namespace selvedge::diagnose
