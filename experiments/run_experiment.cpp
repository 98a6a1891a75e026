#include "experiments/run_experiment.h"

#include <chrono>
#include <cmath>

#include <fmt/format.h>

#include "experiments/simulated_trials.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "fit/stages.h"

namespace selvedge::experiments {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kPrepared = 0.2;  // share of the time that goes into trials and starts

std::string inputs_of(const ExperimentFile& file, bool quick) {
  std::string text = fmt::format("experiment-inputs/1{}\n", quick ? ", quick" : "");
  for (const Fabric& f : file.fabrics) {
    const cloth::Material& m = f.material;
    text += f.name + ": ";
    text += f.recorded()
                ? std::filesystem::weakly_canonical(f.campaign).string()
                : fmt::format("{} {} {} {} {} {} {} {} {} {}", m.density, m.stretch, m.shear, m.bend, m.stretch_damping,
                              m.shear_damping, m.bend_damping, m.drag_normal, m.drag_tangent, m.drag_fade);
    text += '\n';
  }
  return text + "\n" + files::read_whole(file.path);
}

// A folder with other inputs is refused before anything is written.
void open_folder(const std::filesystem::path& folder, const std::string& inputs) {
  const std::filesystem::path path = folder / "inputs.txt";
  if (std::filesystem::exists(path) && files::read_whole(path) != inputs)
    refuse("--out " + folder.string(),
           "found results of other inputs (see its inputs.txt), expected a new folder or one of this experiment");
  std::filesystem::create_directories(folder);
  files::write_whole(path, inputs);
}

// Recorded trials are read before anything is written.
std::vector<trial::Campaign> read_recorded(const ExperimentFile& file) {
  std::vector<trial::Campaign> campaigns(file.fabrics.size());
  for (size_t i = 0; i < file.fabrics.size(); ++i) {
    const Fabric& f = file.fabrics[i];
    if (!f.recorded()) continue;
    trial::Campaign whole = trial::read_campaign(f.campaign);
    trial::Campaign& used = campaigns[i];
    used.folder = whole.folder;
    used.fabric = whole.fabric;
    size_t fitted = 0;
    for (trial::Trial& t : whole.trials) {
      if (!is_fitted(file.kind, t.experiment) && !is_predicted(file.kind, t.experiment)) continue;
      fitted += is_fitted(file.kind, t.experiment);
      if (file.fit.error == ErrorKind::folds && !t.frames)
        refuse((t.folder / "trial.json").string(),
               "found no frames, expected images: error = \"folds\" compares pictures; \"residuals\" does not");
      used.trials.push_back(std::move(t));
    }
    if (fitted == 0)
      refuse(f.campaign.string(), "found no {} trial, expected at least one to fit",
             file.kind == Kind::static_hang ? "static" : "waving");
    if (file.kind == Kind::robot && fitted == used.trials.size())
      refuse(f.campaign.string(), "found no robot trial, expected at least one to predict");
  }
  return campaigns;
}

std::vector<FabricOutcome> prepare(const ExperimentFile& file, std::vector<trial::Campaign> campaigns,
                                   const std::filesystem::path& folder, const report::ProgressCallback& progress) {
  std::vector<FabricOutcome> all;
  const double count = static_cast<double>(file.fabrics.size());
  for (size_t i = 0; i < file.fabrics.size(); ++i) {
    const Fabric& f = file.fabrics[i];
    const double from = kPrepared * static_cast<double>(i) / count, each = kPrepared / count;
    if (!f.recorded())
      campaigns[i] = record_fabric(f, file.protocol, folder / "trials" / f.name,
                                   fit::part_of(progress, from, from + 0.4 * each, f.name));
    FabricOutcome out;
    out.fabric = prepare_case(f, campaigns[i], file.kind, file.fit,
                              fit::part_of(progress, from + 0.4 * each, from + each, f.name));
    for (size_t t = 0; t < campaigns[i].trials.size(); ++t) {
      const bool fits = is_fitted(file.kind, campaigns[i].trials[t].experiment);
      (fits ? out.fitted : out.predicted).push_back(t);
    }
    if (file.kind == Kind::generalisation)
      for (const size_t t : out.fitted)
        if (goes_on(*out.fabric, t)) out.predicted.push_back(t);
    if (file.kind == Kind::generalisation && out.predicted.empty())
      refuse(campaigns[i].folder.string(),
             "found no trial longer than the {} frames that are fitted, expected one to predict", file.fit.frames);
    // Static trials show no drag.
    out.searched = file.kind == Kind::static_hang ? 6 : static_cast<Index>(out.fabric->parameters.size());
    all.push_back(std::move(out));
  }
  return all;
}

IdentificationOptions options_of(const FitPlan& plan, const std::string& optimiser,
                                 const report::ProgressCallback& progress) {
  IdentificationOptions options;
  options.optimiser = optimiser;
  options.evaluations = plan.evaluations;
  options.iterations = plan.iterations;
  options.seed = plan.seed;
  options.progress = progress;
  return options;
}

MatrixXd predict(const FabricOutcome& f, Kind kind) {
  const FabricCase& c = *f.fabric;
  const Index optimisers = static_cast<Index>(f.identified.size());
  MatrixXd sets(c.start.size(), 1 + optimisers + (c.truth ? 1 : 0));
  sets.col(0) = c.start;
  for (Index k = 0; k < optimisers; ++k) sets.col(1 + k) = f.identified[static_cast<size_t>(k)].set();
  if (c.truth) sets.rightCols(1) = *c.truth;
  return kind == Kind::generalisation ? later_errors(c, sets, f.predicted) : errors(c, sets, f.predicted);
}

void run_fits(ExperimentOutcome& out, const KeptFits& kept, const report::ProgressCallback& progress) {
  const FitPlan& plan = out.file.fit;
  const double repeats_share = plan.repeats > 0 ? 0.2 : 0;
  const double span = 1 - kPrepared - repeats_share,
               each = span / static_cast<double>(out.fabrics.size() * plan.optimisers.size());
  double from = kPrepared;
  for (FabricOutcome& f : out.fabrics) {
    for (const std::string& optimiser : plan.optimisers) {
      const auto part = fit::part_of(progress, from, from + each, f.fabric->fabric.name + ", " + optimiser);
      f.identified.push_back(identify(*f.fabric, f.fitted, f.searched, options_of(plan, optimiser, part), kept));
      from += each;
    }
    if (!f.predicted.empty()) f.prediction = predict(f, out.file.kind);
  }
  if (plan.repeats == 0) return;
  for (size_t i = 0; i < out.fabrics.size(); ++i)
    if (out.fabrics[i].fabric->fabric.name == plan.repeated_fabric) out.repeated = i;
  // Least squares have no chance in them, so that searches alone are repeated.
  const std::string search = plan.optimisers.front() == "least_squares" ? "annealing" : plan.optimisers.front();
  const FabricOutcome& f = out.fabrics[out.repeated];
  out.repeats = repeat(*f.fabric, f.fitted.front(), f.searched, plan.repeats,
                       options_of(plan, search, fit::part_of(progress, from, 1, f.fabric->fabric.name)), kept);
}

}  // namespace

MatrixXd cross_errors(const std::vector<FabricOutcome>& fabrics, size_t optimiser) {
  const auto count = static_cast<Index>(fabrics.size());
  MatrixXd matrix(count, count);
  for (Index i = 0; i < count; ++i)
    for (Index j = 0; j < count; ++j) {
      const FabricOutcome &recorded = fabrics[static_cast<size_t>(i)], &simulated = fabrics[static_cast<size_t>(j)];
      matrix(i, j) =
          error_beside(*recorded.fabric, *simulated.fabric, simulated.identified[optimiser].set(), recorded.fitted);
    }
  return matrix;
}

ExperimentOutcome run_experiment(const ExperimentFile& asked, bool quick, const std::filesystem::path& folder,
                                 const report::ProgressCallback& progress) {
  const auto begin = std::chrono::steady_clock::now();
  ExperimentOutcome out;
  out.file = quick ? quick_version(asked) : asked;
  out.quick = quick;
  const std::string inputs = inputs_of(out.file, quick);
  if (out.file.kind == Kind::skirt) {
    const SkirtScene scene = read_skirt_scene(out.file.skirt);
    open_folder(folder, inputs);
    out.skirts = wear_skirts(scene, out.file.skirt, out.file.fabrics, folder / "skirts", progress);
  } else {
    std::vector<trial::Campaign> campaigns = read_recorded(out.file);
    open_folder(folder, inputs);
    out.fabrics = prepare(out.file, std::move(campaigns), folder, progress);
    run_fits(out, KeptFits(folder / "fits"), progress);
    if (out.file.kind == Kind::cross)
      for (size_t k = 0; k < out.file.fit.optimisers.size(); ++k) out.cross.push_back(cross_errors(out.fabrics, k));
  }
  out.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  progress(1, "done");
  return out;
}

}  // namespace selvedge::experiments
