#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "experiments/experiment_report.h"

namespace selvedge::experiments {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::string shown(double value) { return std::isfinite(value) ? fmt::format("{:.4g}", value) : "–"; }

std::string percent(double value) { return value > 100 ? ">100" : fmt::format("{:.3g}", value); }

std::string value_at(const FabricCase& c, Index k, const VectorXd& set) {
  return shown(model::to_value(c.parameters[static_cast<size_t>(k)], set(k)));
}

// The paper's cells of a row, set to the right of ours.
class PaperColumns {
 public:
  PaperColumns(const std::vector<std::string>& columns, const PaperRows* rows) : columns_(columns), rows_(rows) {}
  void head(std::vector<std::string>& header) const {
    if (rows_)
      for (const std::string& c : columns_) header.push_back("paper " + c);
  }
  void add(const std::string& name, std::vector<std::string>& row) const {
    if (!rows_) return;
    const auto found = rows_->find(name);
    for (size_t k = 0; k < columns_.size(); ++k) row.push_back(found == rows_->end() ? "" : found->second[k]);
  }

 private:
  const std::vector<std::string>& columns_;
  const PaperRows* rows_;
};

const PaperRows* rows_of(const PaperTable& paper, const std::string& fabric) {
  const auto found = paper.fabrics.find(fabric);
  return found == paper.fabrics.end() ? nullptr : &found->second;
}

std::string error_name(const FabricCase& c, size_t number) {
  return c.error == ErrorKind::folds ? fmt::format("E{}", number + 1) : fmt::format("error {}, mm", number + 1);
}

std::string sum_name(const FabricCase& c, size_t trials) {
  std::string name = c.error == ErrorKind::folds ? "E1" : "error 1";
  for (size_t t = 1; t < trials; ++t) name += fmt::format("+{}{}", c.error == ErrorKind::folds ? "E" : "", t + 1);
  return name;
}

ResultTable prediction_table(const ExperimentOutcome& out) {
  ResultTable table;
  const bool later = out.file.kind == Kind::generalisation;
  const bool folds = out.file.fit.error == ErrorKind::folds;
  table.title = fmt::format("{}, {}",
                            later ? fmt::format("Frames after the {} that were fitted", out.file.fit.frames)
                                  : "Robot trials, which were not fitted",
                            folds ? "E a frame" : "mm");
  table.header = {"fabric", "trial", "start"};
  for (const std::string& name : out.file.fit.optimisers) {
    table.header.push_back(name);
    table.header.push_back(name + ", fitted frames");
  }
  table.header.push_back("true parameters");
  for (const FabricOutcome& f : out.fabrics)
    for (size_t p = 0; p < f.predicted.size(); ++p) {
      std::vector<std::string> row = {f.fabric->fabric.name, f.fabric->campaign.trials[f.predicted[p]].name,
                                      shown(f.prediction(0, static_cast<Index>(p)))};
      for (size_t k = 0; k < f.identified.size(); ++k) {
        const Identification& found = f.identified[k];
        row.push_back(shown(f.prediction(static_cast<Index>(k) + 1, static_cast<Index>(p))));
        row.push_back(shown(found.chosen_error() / static_cast<double>(f.fitted.size())));
      }
      row.push_back(f.fabric->truth ? shown(f.prediction(f.prediction.rows() - 1, static_cast<Index>(p))) : "");
      table.rows.push_back(std::move(row));
    }
  return table;
}

ResultTable skirt_table(const ExperimentOutcome& out) {
  ResultTable table{"The skirt in each fabric",
                    {"fabric", "triangles", "frames", "that intersect", "largest strain, %", "deepest in body, mm",
                     "hem, mean width, m", "wall time per simulated second, s"},
                    {}};
  for (const SkirtOutcome& s : out.skirts) {
    if (!s.finite) {
      table.rows.push_back({s.fabric, std::to_string(s.triangles), "diverged", "", "", "", "", ""});
      continue;
    }
    table.rows.push_back({s.fabric, std::to_string(s.triangles), std::to_string(s.frames),
                          std::to_string(s.frames_that_intersect), fmt::format("{:.1f}", 100 * s.largest_strain),
                          fmt::format("{:.2f}", 1e3 * s.deepest_in_body_m), fmt::format("{:.3f}", s.hem_width_m),
                          fmt::format("{:.1f}", s.wall_s / s.simulated_s)});
  }
  return table;
}

}  // namespace

ResultTable parameter_table(const std::string& title, const FabricOutcome& f, const Identification& found,
                            const PaperTable& paper) {
  const FabricCase& c = *f.fabric;
  const PaperColumns papers(paper.columns, rows_of(paper, c.fabric.name));
  ResultTable table{title, {"", "start"}, {}};
  table.header.insert(table.header.end(), found.labels.begin(), found.labels.end());
  if (c.truth) table.header.push_back("true");
  table.header.push_back("variability, %");
  papers.head(table.header);
  for (Index k = 0; k < f.searched; ++k) {
    const model::Parameter& p = c.parameters[static_cast<size_t>(k)];
    std::vector<std::string> row = {p.name + ", " + p.unit, value_at(c, k, c.start)};
    for (const OneFit& one : found.fits) row.push_back(value_at(c, k, one.set));
    if (c.truth) row.push_back(value_at(c, k, *c.truth));
    row.push_back(percent(found.variability[static_cast<size_t>(k)]));
    papers.add(p.name, row);
    table.rows.push_back(std::move(row));
  }
  const auto error_row = [&](const std::string& name, const VectorXd& values) {
    std::vector<std::string> row = {name};
    for (const double v : values) row.push_back(shown(v));
    row.resize(row.size() + (c.truth ? 2 : 1));
    papers.add(name, row);
    table.rows.push_back(std::move(row));
  };
  for (Index t = 0; t < found.error.cols(); ++t) error_row(error_name(c, static_cast<size_t>(t)), found.error.col(t));
  if (found.error.cols() > 1) error_row(sum_name(c, f.fitted.size()), found.error.rowwise().sum());
  return table;
}

ResultTable repeats_table(const std::string& title, const FabricOutcome& f, const Repeats& repeats,
                          const PaperTable& paper) {
  const FabricCase& c = *f.fabric;
  const PaperColumns papers(paper.repeated_columns, paper.repeated.empty() ? nullptr : &paper.repeated);
  ResultTable table{title, {""}, {}};
  for (size_t i = 0; i < repeats.fits.size(); ++i) table.header.push_back(fmt::format("run {}", i + 1));
  papers.head(table.header);
  for (Index k = 0; k < f.searched; ++k) {
    const model::Parameter& p = c.parameters[static_cast<size_t>(k)];
    std::vector<std::string> row = {p.name + ", " + p.unit};
    for (const OneFit& one : repeats.fits) row.push_back(value_at(c, k, one.set));
    papers.add(p.name, row);
    table.rows.push_back(std::move(row));
  }
  std::vector<std::string> row = {error_name(c, 0)};
  for (const double e : repeats.error) row.push_back(shown(e));
  papers.add(error_name(c, 0), row);
  table.rows.push_back(std::move(row));
  return table;
}

ResultTable cross_table(const std::string& title, const std::vector<FabricOutcome>& fabrics, const MatrixXd& matrix) {
  ResultTable table{title, {"recorded \\ simulated"}, {}};
  for (Index i = 0; i < matrix.rows(); ++i) {
    const std::string& name = fabrics[static_cast<size_t>(i)].fabric->fabric.name;
    table.header.push_back(name);
    std::vector<std::string> row = {name};
    for (const double e : matrix.row(i)) row.push_back(shown(e));
    Index best;
    matrix.row(i).minCoeff(&best);
    row.push_back(best == i ? "own" : fabrics[static_cast<size_t>(best)].fabric->fabric.name);
    table.rows.push_back(std::move(row));
  }
  table.header.push_back("least");
  return table;
}

int own_wins(const MatrixXd& matrix) {
  int wins = 0;
  for (Index i = 0; i < matrix.rows(); ++i) wins += matrix(i, i) <= matrix.row(i).minCoeff();
  return wins;
}

std::vector<ResultTable> tables_of(const ExperimentOutcome& out) {
  std::vector<ResultTable> tables;
  if (out.file.kind == Kind::skirt) return {skirt_table(out)};
  for (const FabricOutcome& f : out.fabrics)
    for (const Identification& found : f.identified)
      tables.push_back(
          parameter_table(fmt::format("{}, {}: {} ({} chosen, {:.1f} s)", f.fabric->fabric.name, found.optimiser,
                                      out.file.title, found.labels[found.chosen], found.wall_s()),
                          f, found, out.file.paper));
  if (!out.repeats.fits.empty()) {
    const FabricOutcome& f = out.fabrics[out.repeated];
    tables.push_back(repeats_table(fmt::format("{}, {} searched again from starts within 5 %", f.fabric->fabric.name,
                                               f.fabric->campaign.trials[f.fitted.front()].name),
                                   f, out.repeats, out.file.paper));
  }
  if (out.fabrics.size() > 1)
    for (size_t k = 0; k < out.cross.size(); ++k)
      tables.push_back(cross_table(
          fmt::format(
              "Every fabric's parameters beside every fabric's recording, {}, {}", out.file.fit.optimisers[k],
              out.file.fit.error == ErrorKind::folds ? "E summed over the trials" : "mm summed over the trials"),
          out.fabrics, out.cross[k]));
  if (!out.fabrics.front().predicted.empty()) tables.push_back(prediction_table(out));
  return tables;
}

std::vector<std::string> remarks_of(const ExperimentOutcome& out) {
  std::vector<std::string> remarks;
  for (const FabricOutcome& f : out.fabrics)
    for (const Identification& found : f.identified) {
      std::string names;
      for (size_t k = 0; k < found.variability.size(); ++k)
        if (found.variability[k] > 100) names += (names.empty() ? "" : ", ") + f.fabric->parameters[k].name;
      if (!names.empty())
        remarks.push_back(fmt::format(
            "{}, {}: these trials leave {} undetermined (a change by 100 % moves the error by less than 1 %)",
            f.fabric->fabric.name, found.optimiser, names));
    }
  if (out.fabrics.size() > 1)
    for (size_t k = 0; k < out.cross.size(); ++k)
      remarks.push_back(fmt::format("{}: own parameters are the best for {} of {} recordings",
                                    out.file.fit.optimisers[k], own_wins(out.cross[k]), out.fabrics.size()));
  if (!out.file.paper.source.empty()) remarks.push_back("Paper: " + out.file.paper.source);
  if (!out.file.paper.remark.empty()) remarks.push_back(out.file.paper.remark);
  if (out.quick) remarks.push_back("A quick run: its figures show that the experiment runs, and no more");
  return remarks;
}

}  // namespace selvedge::experiments
