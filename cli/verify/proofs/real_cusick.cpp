// Five fabrics draped over a support, eight samples each: fitted to samples 1 to 4, the drape coefficient of the others
// predicted.
#include <chrono>
#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "cli/verify/proofs/real.h"
#include "material_tests/cusick.h"
#include "station/exchange/outline_import.h"

namespace selvedge::cli {

namespace {

// What its authors give, in the README's order.
struct Draped {
  const char* name;
  double areal_mass, coefficient_percent, deviation_percent;
};
const Draped draped[] = {{"cotton white", 0.059, 47.7, 3.3},
                         {"cotton blue", 0.192, 69.8, 6.2},
                         {"viscose white", 0.213, 15.4, 1.1},
                         {"cotton pink", 0.114, 61.9, 4.3},
                         {"wool red", 0.274, 77.7, 1.7}};
constexpr size_t kSoftest = 2, kSamplesFitted = 4;
constexpr double kMost_s = 120;

using Trials = std::vector<trial::Trial>;

station::ImportedOutlines imported(const std::filesystem::path& folder, const Draped& fabric, double mm_per_px) {
  station::OutlineImport from;
  from.source = folder;
  from.fabric = fabric.name;
  from.areal_mass = fabric.areal_mass;
  from.mm_per_px = mm_per_px;
  return station::import_cusick(from);
}

std::vector<const trial::Trial*> part(const Trials& trials, size_t from, size_t to) {
  std::vector<const trial::Trial*> out;
  for (size_t i = from; i < std::min(to, trials.size()); ++i) out.push_back(&trials[i]);
  return out;
}

std::string fabric_folder(size_t fabric) { return fmt::format("fabric-{}", fabric + 1); }

void prove_fabric(const Draped& fabric, const Trials& trials, const FigureOptions& options,
                  std::vector<Figure>& figures) {
  const auto start = std::chrono::steady_clock::now();
  const material_tests::CusickFit fit = material_tests::fit_cusick_models(part(trials, 0, kSamplesFitted));
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto pairs = material_tests::predict_drapes(fit, part(trials, kSamplesFitted, trials.size()));
  double predicted = 0, measured = 0, folds = 0, folds_fitted = 0;
  for (const material_tests::DrapePair& p : pairs) {
    const double n = static_cast<double>(pairs.size());
    predicted += 100 * p.fitted.drape_coefficient / n;
    measured += 100 * p.measured.drape_coefficient / n;
    folds += p.measured.folds / n;
    folds_fitted += p.fitted.folds / n;
  }
  std::string laws;
  for (const material_tests::BendingModel& m : fit.models)
    laws +=
        fmt::format(", {} {:.1f} (bend {:.2e} N·m)", m.name, m.log_evidence - fit.best().log_evidence, m.material.bend);
  options.tell(fmt::format(
      "{}: {} bending{}; log evidence beside it{}; samples 5 to 8: {:.1f} % predicted, {:.1f} % "
      "measured, folds {:.1f} and {:.1f}; fitted in {:.0f} s",
      fabric.name, fit.best().name,
      fit.best().name == "anisotropic" ? fmt::format(" (e^±{:.2f}, stiffer at {:.0f}°)",
                                                     fit.best().material.bend_anisotropy, fit.axis_rad * 180 / M_PI)
                                       : "",
      laws, predicted, measured, folds_fitted, folds, took_s));
  const std::string name = fabric.name;
  figures.push_back({name + ": drape coefficient of samples 5 to 8, predicted less measured",
                     std::abs(predicted - measured), fabric.deviation_percent, "%", Relation::at_most,
                     "deviation between captures, the fabric's authors"});
  figures.push_back({name + ": drape coefficient of samples 1 to 4, measured by us", fit.measured_percent.mean,
                     fabric.coefficient_percent, "%", Relation::shown, "the fabric's authors"});
  figures.push_back({name + ": a fit", took_s, kMost_s, "s", Relation::at_most, "asked"});
}

}  // namespace

std::vector<Figure> prove_real_cusick(const std::filesystem::path& folder, const FigureOptions& options) {
  std::vector<Figure> figures;
  // The scale of all: of the fabric that falls steeply enough to show the support's rim.
  const station::ImportedOutlines soft = imported(folder / fabric_folder(kSoftest), draped[kSoftest], 0);
  options.tell(soft.scale);
  for (size_t i = 0; i < std::size(draped); ++i) {
    if (options.quick && i != kSoftest) continue;
    options.progress(static_cast<double>(i) / static_cast<double>(std::size(draped)), draped[i].name);
    prove_fabric(draped[i], imported(folder / fabric_folder(i), draped[i], soft.mm_per_px).trials, options, figures);
  }
  return figures;
}

}  // namespace selvedge::cli
