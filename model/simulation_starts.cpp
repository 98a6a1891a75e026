// Where the motions of a Simulation begin: at an equilibrium on a branch, or underway.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "geometry/order_statistics.h"
#include "model/seen_surface.h"
#include "model/simulation.h"

namespace selvedge::model {

namespace {

// Robust size of the residuals: median of their absolute values.
double median_absolute(const Eigen::VectorXd& r) {
  std::vector<double> seen;
  for (const double x : r)
    if (std::isfinite(x)) seen.push_back(std::abs(x));
  return seen.empty() ? std::numeric_limits<double>::infinity() : geometry::median(std::move(seen));
}

}  // namespace

bool Simulation::rematch(State& state, const std::vector<Parameter>& parameters, const Eigen::VectorXd& coordinates,
                         const std::vector<size_t>& wanted) const {
  // A piece that is led in has no branch: it does not begin at rest.
  std::vector<size_t> trials = all_or(wanted);
  std::erase_if(trials, [&](size_t i) { return state.is_underway(i); });
  std::vector<Eigen::Matrix3Xd> found(trials.size());
  tbb::parallel_for(size_t{0}, trials.size(),
                    [&](size_t i) { found[i] = branch_of(state, trials[i], parameters, coordinates); });
  bool changed = false;
  for (size_t i = 0; i < trials.size(); ++i) {
    constexpr double kAlike_m = 1e-3;
    Eigen::Matrix3Xd& branch = state.branch[trials[i]];
    changed = changed || (found[i] - branch).colwise().squaredNorm().mean() > kAlike_m * kAlike_m;
    branch = std::move(found[i]);
  }
  return changed;
}

// The first observed time alone: all samples at the equilibrium, residuals of that time.
double Simulation::distance_at_first_sight_mm(size_t trial, Prediction prediction, const Eigen::Matrix3Xd& rest) const {
  ObservedTrial first = trials_[trial];
  cloth::Trajectory still;
  still.start = rest;
  still.samples = {rest};
  first.experiment.sample_s = {first.experiment.start_s};
  if (first.markers) {
    const auto times = static_cast<Eigen::Index>(first.markers->time_s.size());
    Eigen::Matrix3Xd initial(3, static_cast<Eigen::Index>(first.markers->uv.size()));
    for (Eigen::Index k = 0; k < initial.cols(); ++k) initial.col(k) = first.markers->position.col(k * times);
    first.markers->position = initial;
    first.markers->time_s.resize(1);
  }
  if (first.stripes) {
    auto one_frame = std::make_shared<observe::StripeTrack>(*first.stripes);
    one_frame->frames.resize(1);
    first.stripes = one_frame;
  }
  prediction.experiment.sample_s = first.experiment.sample_s;
  return median_absolute(residual_of(trial, first, prediction, still));
}

Eigen::Matrix3Xd Simulation::let_go_of(size_t trial, const Prediction& prediction) const {
  cloth::Experiment experiment = prediction.experiment;
  const ObservedTrial& seen = trials_[trial];
  experiment.start_shape = hung_shape(sheet_, experiment, 1);
  for (const double nudging_per_s : {100.0, 30.0, 10.0}) {
    const std::shared_ptr<const cloth::GuideTrack> track =
        seen.markers ? track_of(trial, prediction)
                     : seen_surface(sheet_, view_, *seen.stripes, experiment.start_shape, prediction.sensor);
    experiment.guide = std::make_shared<cloth::Guide>(cloth::Guide{track, nudging_per_s, experiment.start_s});
    cloth::Rest rest = relax(sheet_, {experiment}, options_.sheet).front();
    if (rest.position.allFinite()) experiment.start_shape = std::move(rest.position);
  }
  return experiment.start_shape;
}

Eigen::Matrix3Xd Simulation::branch_of(const State& state, size_t trial, const std::vector<Parameter>& parameters,
                                       const Eigen::VectorXd& coordinates) const {
  const Prediction common = predictions(state, parameters, Eigen::MatrixXd(coordinates), trial, 0, 1).front();
  if (!begins_at_shapes()) return hung_shape(sheet_, common.experiment, 1);
  const bool has_one = state.branch[trial].cols() > 0;
  std::vector<Eigen::Matrix3Xd> shapes;
  if (has_one) shapes.push_back(state.branch[trial]);
  shapes.push_back(let_go_of(trial, common));
  std::vector<cloth::Experiment> lanes;
  for (const Eigen::Matrix3Xd& shape : shapes) {
    lanes.push_back(common.experiment);
    lanes.back().start_shape = shape;
  }
  const std::vector<cloth::Rest> rests = relaxed(lanes);
  // A tenth nearer, or the branch in use stays.
  constexpr double kClearly = 0.9;
  double least = std::numeric_limits<double>::infinity();
  Eigen::Matrix3Xd nearest = shapes.front();
  for (size_t i = 0; i < rests.size(); ++i) {
    if (!rests[i].position.allFinite()) continue;
    const double error = distance_at_first_sight_mm(trial, common, rests[i].position);
    if (error < least) {
      least = has_one && i == 0 ? kClearly * error : error;
      nearest = rests[i].position;
    }
  }
  return nearest;
}

std::vector<cloth::Rest> Simulation::rests_of(const Call& call, const std::vector<Run>& runs,
                                              const std::vector<Prediction>& predicted) const {
  // What acts on motion alone stands at its usual value, so that an equilibrium's bits do not depend on who shares it.
  Eigen::MatrixXd at_rest = call.coordinates;
  for (Eigen::Index set = 0; set < at_rest.cols(); ++set) {
    // In a draught drag acts on what hangs still, too.
    if (!prediction_of(call, {0, 0, set}).experiment.air_velocity_m_s.isZero()) continue;
    for (size_t k = 0; k < call.parameters.size(); ++k)
      if (!call.parameters[k].at_rest)
        at_rest(static_cast<Eigen::Index>(k), set) = to_coordinate(call.parameters[k], call.parameters[k].start);
  }
  const auto begin_alike = [&](const Run& a, const Run& b) {
    const auto branch = [&](const Run& run) -> const Eigen::Matrix3Xd& {
      return call.asked[run.asked].state.branch[run.trial];
    };
    return a.trial == b.trial && at_rest.col(a.set) == at_rest.col(b.set) &&
           (a.asked == b.asked || branch(a) == branch(b));
  };
  std::vector<cloth::Experiment> different;
  std::vector<size_t> sought, rest_of_run;  // places in runs, and in these
  for (size_t i = 0; i < runs.size(); ++i) {
    const Run& run = runs[i];
    if (!predicted[i].experiment.starts_at_rest) {
      rest_of_run.push_back(0);
      continue;
    }
    const auto same = std::find_if(sought.begin(), sought.end(), [&](size_t j) { return begin_alike(runs[j], run); });
    rest_of_run.push_back(static_cast<size_t>(same - sought.begin()));
    if (same != sought.end()) continue;
    sought.push_back(i);
    different.push_back(
        predictions(call.asked[run.asked].state, call.parameters, at_rest, run.trial, run.set, 1).front().experiment);
  }
  const std::vector<cloth::Rest> rests = relaxed(different);
  std::vector<cloth::Rest> out;
  for (size_t i = 0; i < runs.size(); ++i) {
    const cloth::Experiment& e = predicted[i].experiment;
    out.push_back(e.starts_at_rest ? rests[rest_of_run[i]] : cloth::Rest{e.start_shape});
  }
  return out;
}

void Simulation::lead_in(State& state, const std::vector<Parameter>& parameters,
                         const Eigen::VectorXd& coordinates) const {
  constexpr double kNudging_per_s = 20;
  state.underway.clear();
  if (options_.simulator) return;  // nobody nudges another
  state.underway.resize(trials_.size());
  std::vector<size_t> pieces;
  std::vector<cloth::Experiment> lanes;
  for (size_t i = 0; i < trials_.size(); ++i) {
    if (!trials_[i].before) continue;
    Prediction p = predictions(state, parameters, coordinates, i, 0, 1).front();
    ObservedTrial before = trials_[i];
    before.markers = *trials_[i].before;
    cloth::Experiment& e = p.experiment;
    e.start_s = before.markers->time_s.front();
    e.sample_s = {trials_[i].experiment.start_s};
    e.guide = std::make_shared<cloth::Guide>(cloth::Guide{
        guide_track(sheet_, before, marker_points_[i], p), kNudging_per_s, e.start_s, {}, stamps_of(trials_[i], p)});
    pieces.push_back(i);
    lanes.push_back(std::move(e));
  }
  if (lanes.empty()) return;
  std::vector<cloth::Trajectory> moved = simulated(lanes);
  for (size_t k = 0; k < pieces.size(); ++k)
    if (moved[k].finite && moved[k].end_velocity.cols() > 0)
      state.underway[pieces[k]] = {std::move(moved[k].samples.back()), std::move(moved[k].end_velocity),
                                   lanes[k].path.at(lanes[k].sample_s.back())};
}

}  // namespace selvedge::model
