#include "diagnose/replay.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace selvedge::diagnose {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::VectorXd;

namespace {

constexpr int kSheetAcross = 10;  // points of a sheet that is shown, each way
constexpr size_t kMostTrials = 8, kMostTimes = 48;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

void add(report::Points& points, const Eigen::Vector3d& p) {
  for (const double value : p) points.push_back(static_cast<float>(value));
}

// Times to show, as places among those of the markers, or among the samples where there are none.
std::vector<size_t> shown_times(size_t count) {
  std::vector<size_t> out;
  const size_t wanted = std::min(count, kMostTimes);
  for (size_t i = 0; i < wanted; ++i) out.push_back(i * (count - 1) / std::max<size_t>(1, wanted - 1));
  return out;
}

// The markers at one time: where they were seen, off by `off_mm` (3 a marker and time; empty: not at all).
report::Points markers_at(const observe::MarkerTrack& track, size_t time, const VectorXd& off_mm) {
  report::Points out;
  for (size_t k = 0; k < track.uv.size(); ++k) {
    const auto at = static_cast<Index>(k * track.time_s.size() + time);
    Eigen::Vector3d p = track.position.col(at);
    if (off_mm.size() > 0) p += 1e-3 * off_mm.segment<3>(3 * at);
    add(out, p);
  }
  return out;
}

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
  const model::Simulation& simulation = *study.simulation;
  const model::ObservedTrial& seen = simulation.trials()[trial];
  std::vector<cloth::SurfacePoint> points;
  for (int r = 0; r < kSheetAcross; ++r)
    for (int c = 0; c < kSheetAcross; ++c)
      points.push_back(surface_point(simulation.sheet(),
                                     {seen.width_m * c / (kSheetAcross - 1), seen.height_m * r / (kSheetAcross - 1)}));
  const std::vector<double>& sample_s = seen.experiment.sample_s;
  report::SheetView out{name, {}, {}};
  for (const double t : times) {
    const cloth::Trajectory& run = runs[static_cast<size_t>(windows.phase_at(seen, t))];
    const auto after = static_cast<size_t>(std::lower_bound(sample_s.begin(), sample_s.end(), t) - sample_s.begin());
    const size_t at = std::min(after, run.samples.size() - 1);
    report::Points sheet;
    for (const cloth::SurfacePoint& p : points)
      add(sheet, run.finite ? position_of(p, run.samples[at]) : Eigen::Vector3d::Constant(kNaN));
    out.sheet.push_back(std::move(sheet));
  }
  return out;
}

report::Points flat(const Matrix3Xd& columns) {
  report::Points out;
  for (Index i = 0; i < columns.cols(); ++i) add(out, columns.col(i));
  return out;
}

// left_mm: what each model leaves, by trial; view_of: how one of them moves at these times.
report::MovingSheet replay_of(const Study& study, const std::vector<std::vector<VectorXd>>& left_mm,
                              const MissingForce& force, size_t trial,
                              const std::function<report::SheetView(size_t, const std::vector<double>&)>& view_of) {
  const model::ObservedTrial& seen = study.simulation->trials()[trial];
  const std::vector<double>& all = seen.markers ? seen.markers->time_s : seen.experiment.sample_s;
  const std::vector<size_t> places = shown_times(all.size());
  report::MovingSheet out;
  out.name = seen.name;
  out.across = kSheetAcross;
  std::vector<double> times;
  for (const size_t at : places) {
    times.push_back(all[at]);
    out.time_s.push_back(static_cast<float>(all[at]));
    out.seen.push_back(seen.markers ? markers_at(*seen.markers, at, {}) : report::Points());
  }
  for (size_t k = 0; k < left_mm.size(); ++k) {
    report::SheetView view = view_of(k, times);
    if (seen.markers) {
      const VectorXd& off_mm = left_mm[k][trial];
      for (const size_t at : places) view.expected.push_back(markers_at(*seen.markers, at, off_mm));
    }
    out.views.push_back(std::move(view));
  }
  for (const Eigen::Vector2d& uv : force.uv_m) {
    out.arrow_uv.push_back(static_cast<float>(uv.x() / seen.width_m));
    out.arrow_uv.push_back(static_cast<float>(uv.y() / seen.height_m));
  }
  for (const MissingForce::Window& w : force.windows)
    if (w.trial == seen.name)
      out.arrows.push_back(
          {static_cast<float>(w.from_s), static_cast<float>(w.to_s), flat(w.mean_n_m2), flat(w.sd_n_m2)});
  return out;
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
