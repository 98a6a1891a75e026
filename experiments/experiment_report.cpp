#include "experiments/experiment_report.h"

#include <cmath>

#include <fmt/format.h>

#include "files/json_number.h"
#include "files/whole_file.h"
#include "report/html.h"

namespace selvedge::experiments {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using nlohmann::json;

json values_of(const FabricCase& c, const VectorXd& set) {
  json values = json::object();
  for (size_t k = 0; k < c.parameters.size(); ++k)
    values[c.parameters[k].name] = {{"value", model::to_value(c.parameters[k], set(static_cast<Index>(k)))},
                                    {"unit", c.parameters[k].unit}};
  return values;
}

json errors_by_trial(const FabricCase& c, const std::vector<size_t>& trials, const MatrixXd& errors, Index row) {
  json by_name = json::object();
  for (size_t t = 0; t < trials.size(); ++t)
    by_name[c.campaign.trials[trials[t]].name] = files::finite_or_null(errors(row, static_cast<Index>(t)));
  return by_name;
}

json to_json(const FabricOutcome& f, const Identification& found) {
  const FabricCase& c = *f.fabric;
  json sets = json::object(), variability = json::object();
  for (size_t k = 0; k < found.fits.size(); ++k) {
    const OneFit& one = found.fits[k];
    sets[found.labels[k]] = {{"parameters", values_of(c, one.set)},
                             {"error", errors_by_trial(c, f.fitted, found.error, static_cast<Index>(k) + 1)},
                             {"evaluations", one.evaluations},
                             {"wall_s", one.wall_s},
                             {"evaluations_from_journal", one.from_journal}};
    for (Index i = 0; i < one.sd.size(); ++i)
      sets[found.labels[k]]["standard_deviation_percent"][c.parameters[static_cast<size_t>(i)].name] =
          files::finite_or_null(100 * one.sd(i));
  }
  for (size_t k = 0; k < found.variability.size(); ++k)
    variability[c.parameters[k].name] = files::finite_or_null(found.variability[k]);
  return {{"sets", sets}, {"chosen", found.labels[found.chosen]}, {"variability_percent", variability}};
}

json to_json(const FabricOutcome& f) {
  const FabricCase& c = *f.fabric;
  json out = {{"start",
               {{"parameters", values_of(c, c.start)},
                {"error", errors_by_trial(c, f.fitted, f.identified.front().error, 0)}}}};
  if (c.truth) out["true"] = values_of(c, *c.truth);
  else out["campaign"] = c.fabric.campaign.string();
  for (size_t k = 0; k < f.identified.size(); ++k) {
    out["optimisers"][f.identified[k].optimiser] = to_json(f, f.identified[k]);
    if (!f.predicted.empty())
      out["optimisers"][f.identified[k].optimiser]["predicted"] =
          errors_by_trial(c, f.predicted, f.prediction, static_cast<Index>(k) + 1);
  }
  if (!f.predicted.empty()) {
    out["start"]["predicted"] = errors_by_trial(c, f.predicted, f.prediction, 0);
    if (c.truth) out["predicted_by_truth"] = errors_by_trial(c, f.predicted, f.prediction, f.prediction.rows() - 1);
  }
  return out;
}

json to_json(const SkirtOutcome& s) {
  return {{"triangles", s.triangles},
          {"frames", s.frames},
          {"frames_that_intersect", s.frames_that_intersect},
          {"largest_strain", files::finite_or_null(s.largest_strain)},
          {"deepest_in_body_m", files::finite_or_null(s.deepest_in_body_m)},
          {"hem_mean_width_m", s.hem_width_m},
          {"simulated_s", s.simulated_s},
          {"wall_s", s.wall_s},
          {"finite", s.finite}};
}

json to_json(const PaperTable& paper) {
  return {{"source", paper.source},
          {"columns", paper.columns},
          {"fabrics", paper.fabrics},
          {"repeated_columns", paper.repeated_columns},
          {"repeated", paper.repeated}};
}

json to_json(const ExperimentOutcome& out) {
  json fabrics = json::object(), cross = json::object();
  for (const FabricOutcome& f : out.fabrics) fabrics[f.fabric->fabric.name] = to_json(f);
  for (const SkirtOutcome& s : out.skirts) fabrics[s.fabric] = to_json(s);
  for (size_t k = 0; k < out.cross.size(); ++k)
    for (Index i = 0; i < out.cross[k].rows(); ++i)
      for (Index j = 0; j < out.cross[k].cols(); ++j)
        cross[out.file.fit.optimisers[k]][out.fabrics[static_cast<size_t>(i)].fabric->fabric.name]
             [out.fabrics[static_cast<size_t>(j)].fabric->fabric.name] = files::finite_or_null(out.cross[k](i, j));
  json all = {{"format", "experiment/1"},
              {"kind", to_text(out.file.kind)},
              {"title", out.file.title},
              {"file", out.file.path.filename().string()},
              {"quick", out.quick},
              {"fabrics", fabrics},
              {"remarks", remarks_of(out)},
              {"wall_s", out.wall_s},
              {"paper", to_json(out.file.paper)}};
  if (!out.skirts.empty()) return all;
  all["error"] = out.file.fit.error == ErrorKind::folds ? "E per frame" : "mm root mean square";
  all["evaluations"] = out.file.fit.evaluations;
  if (!cross.empty()) all["cross"] = cross;
  for (size_t i = 0; i < out.repeats.fits.size(); ++i)
    all["repeats"].push_back({{"fabric", out.fabrics[out.repeated].fabric->fabric.name},
                              {"parameters", values_of(*out.fabrics[out.repeated].fabric, out.repeats.fits[i].set)},
                              {"error", files::finite_or_null(out.repeats.error[i])}});
  return all;
}

// Best error so far and temperature against evaluations (the paper's figure 5).
void add_progress(report::HtmlReport& html, const FabricOutcome& f, const Identification& found) {
  std::vector<report::Series> series;
  for (size_t k = 0; k < found.fits.size(); ++k) {
    report::Series best{found.labels[k] + ", best error", {}, {}},
        temperature{found.labels[k] + ", temperature", {}, {}};
    for (const estimate::SearchStep& step : found.fits[k].trace) {
      best.x.push_back(step.evaluations);
      best.y.push_back(step.best_cost);
      if (!std::isfinite(step.temperature)) continue;
      temperature.x.push_back(step.evaluations);
      temperature.y.push_back(step.temperature);
    }
    if (!best.x.empty()) series.push_back(best);
    if (!temperature.x.empty()) series.push_back(temperature);
  }
  if (series.empty()) return;
  report::PlotOptions plot;
  plot.x_label = "evaluations";
  plot.y_label = "error, and temperature in its unit";
  plot.log_y = true;
  html.svg(report::line_plot(series, plot),
           fmt::format("{}, {}: the search of each trial", f.fabric->fabric.name, found.optimiser));
}

// The paper's figure 11; what cannot be seen at all stands at the end of the scale.
void add_variability(report::HtmlReport& html, const FabricOutcome& f, const Identification& found) {
  std::vector<std::string> labels;
  std::vector<double> values;
  for (size_t k = 0; k < found.variability.size(); ++k) {
    labels.push_back(f.fabric->parameters[k].name);
    values.push_back(std::min(found.variability[k], 100.0));
  }
  html.svg(report::bar_plot(labels, values, "change for 1 % of error, %; 100 and more in one"),
           fmt::format("{}, {}: variability", f.fabric->fabric.name, found.optimiser));
}

// One curve a recording over the fabrics that were simulated (the paper's figure 14).
void add_curves(report::HtmlReport& html, const ExperimentOutcome& out, size_t optimiser) {
  std::vector<report::Series> curves;
  std::string order;
  for (Index i = 0; i < out.cross[optimiser].rows(); ++i) {
    report::Series curve{out.fabrics[static_cast<size_t>(i)].fabric->fabric.name, {}, {}};
    for (Index j = 0; j < out.cross[optimiser].cols(); ++j) {
      curve.x.push_back(static_cast<double>(j + 1));
      curve.y.push_back(out.cross[optimiser](i, j));
    }
    order += fmt::format("{}{} {}", i == 0 ? "" : ", ", i + 1, curve.name);
    curves.push_back(std::move(curve));
  }
  report::PlotOptions plot;
  plot.x_label = "simulated fabric: " + order;
  plot.y_label = "error";
  plot.log_y = true;
  html.svg(report::line_plot(curves, plot),
           fmt::format("{}: each curve is one fabric's recordings", out.file.fit.optimisers[optimiser]));
}

void add_skirts(report::HtmlReport& html, const ExperimentOutcome& out) {
  for (const SkirtOutcome& s : out.skirts) {
    if (s.pictures.empty()) continue;
    html.heading(s.fabric);
    std::vector<std::string> captions;
    for (const double t : s.picture_s) captions.push_back(fmt::format("{:.2f} s", t));
    html.picture_row(s.pictures, captions);
  }
}

}  // namespace

void write_experiment(const ExperimentOutcome& out, const std::filesystem::path& folder) {
  report::HtmlReport html(out.file.title);
  for (const std::string& remark : remarks_of(out)) html.paragraph(remark + ".");
  for (const ResultTable& table : tables_of(out)) {
    html.heading(table.title);
    html.table(table.header, table.rows);
  }
  for (size_t k = 0; k < out.cross.size() && out.fabrics.size() > 1; ++k) add_curves(html, out, k);
  if (!out.fabrics.empty()) html.heading("Searches, and what is known of each parameter");
  for (const FabricOutcome& f : out.fabrics)
    for (const Identification& found : f.identified) {
      add_progress(html, f, found);
      add_variability(html, f, found);
    }
  add_skirts(html, out);
  html.write(folder / "report.html");
  files::write_json(folder / "result.json", to_json(out));
}

}  // namespace selvedge::experiments
