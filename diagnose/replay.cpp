#include "diagnose/replay.h"

#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "fit/shown_motion.h"

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr size_t kMostTrials = 8;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// How a trial moves under one model, in each of the runs of its windows.
using Runs = std::vector<cloth::Trajectory>;

// Of each model in each of these trials, side by side in lanes.
std::vector<std::vector<Runs>> runs_of(const Study& study, const Windows& windows, const std::vector<Shown>& models,
                                       const std::vector<size_t>& trials) {
  const model::Simulation& simulation = *study.simulation;
  std::vector<cloth::Experiment> lanes;
  for (const Shown& model : models)
    for (const size_t trial : trials)
      for (int phase = 0; phase < windows.phases(simulation.trials()[trial]); ++phase)
        lanes.push_back(
            simulation
                .predictions(windows.held(simulation, model.branches, phase), study.parameters, model.x, trial, 0, 1)
                .front()
                .experiment);
  std::vector<cloth::Trajectory> found = simulation.simulated(lanes);
  auto next = found.begin();
  std::vector<std::vector<Runs>> out(models.size(), std::vector<Runs>(trials.size()));
  for (std::vector<Runs>& of_model : out)
    for (size_t i = 0; i < trials.size(); ++i)
      for (int phase = 0; phase < windows.phases(simulation.trials()[trials[i]]); ++phase)
        of_model[i].push_back(std::move(*next++));
  return out;
}

// The swatch at these times, each from the run that is free then.
report::SheetView view_of(const Study& study, const Windows& windows, const std::string& name, const Runs& runs,
                          size_t trial, const std::vector<double>& times) {
  const fit::ShownSwatch swatch(*study.simulation, trial);
  const model::ObservedTrial& seen = study.simulation->trials()[trial];
  report::SheetView out{name, {}, {}};
  for (const double t : times) out.sheet.push_back(swatch.at(runs[static_cast<size_t>(windows.phase_at(seen, t))], t));
  return out;
}

// left_mm: what each model leaves, by trial; view_of: how one of them moves at these times.
report::MovingSheet replay_of(const Study& study, const std::vector<std::vector<VectorXd>>& left_mm,
                              const MissingForce& force, size_t trial,
                              const std::function<report::SheetView(size_t, const std::vector<double>&)>& view_of) {
  const model::ObservedTrial& seen = study.simulation->trials()[trial];
  fit::RecordedMotion recorded = fit::recorded_motion(seen);
  for (size_t k = 0; k < left_mm.size(); ++k) {
    report::SheetView view = view_of(k, recorded.time_s);
    view.expected = fit::expected_markers(seen, recorded, left_mm[k][trial]);
    recorded.shown.views.push_back(std::move(view));
  }
  report::MovingSheet& out = recorded.shown;
  for (const Eigen::Vector2d& uv : force.uv_m) {
    out.arrow_uv.push_back(static_cast<float>(uv.x() / seen.width_m));
    out.arrow_uv.push_back(static_cast<float>(uv.y() / seen.height_m));
  }
  for (const MissingForce::Window& w : force.windows)
    if (w.trial == seen.name)
      out.arrows.push_back(
          {static_cast<float>(w.from_s), static_cast<float>(w.to_s), fit::flat(w.mean_n_m2), fit::flat(w.sd_n_m2)});
  return std::move(out);
}

}  // namespace

std::vector<VectorXd> by_trial(const Study& study, const Windows& windows, const VectorXd& residual) {
  std::vector<VectorXd> out;
  for (size_t t = 0; t < study.simulation->trials().size(); ++t)
    out.push_back(VectorXd::Constant(study.simulation->time_s(t).size(), kNaN));
  for (const Window& w : windows.windows())
    for (Index i = w.first; i < w.first + w.count; ++i) out[w.trial](windows.place(i)) = residual(i);
  return out;
}

std::vector<report::MovingSheet> replay(const Study& study, const Windows& windows, const std::vector<Shown>& models,
                                        const MissingForce& force) {
  std::vector<std::vector<VectorXd>> left_mm;
  for (const Shown& model : models) left_mm.push_back(by_trial(study, windows, model.residual));
  std::vector<size_t> trials;
  for (const std::vector<size_t>& group : study.groups)
    for (const size_t t : group)
      if (trials.size() < kMostTrials && !study.simulation->trials()[t].still) {
        trials.push_back(t);
        break;
      }
  const std::vector<std::vector<Runs>> runs = runs_of(study, windows, models, trials);
  std::vector<report::MovingSheet> out;
  for (size_t i = 0; i < trials.size(); ++i)
    out.push_back(replay_of(study, left_mm, force, trials[i], [&](size_t k, const std::vector<double>& times) {
      return view_of(study, windows, models[k].name, runs[k][i], trials[i], times);
    }));
  return out;
}

}  // namespace selvedge::diagnose
