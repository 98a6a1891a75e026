#include "model/simulation.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <tbb/parallel_for.h>

#include "cloth/material_parameters.h"
#include "cloth/spline/chosen_grid.h"
#include "model/ranks/bytes.h"
#include "model/ranks/ranks.h"
#include "observe/stripe_residual.h"

namespace selvedge::model {

namespace {

using Eigen::Index;

Index residual_count(const ObservedTrial& trial) {
  Index count = 0;
  if (trial.markers) count += 3 * trial.markers->position.cols();
  if (trial.stripes)
    for (const observe::StripeFrame& f : trial.stripes->frames) count += f.points();
  return count;
}

std::vector<size_t> all_of(size_t count) {
  std::vector<size_t> all(count);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

cloth::spline::SplineSheet sheet_for(const ObservedTrial& trial, int cells) {
  const cloth::spline::Swatch swatch{trial.width_m, trial.height_m};
  return make_spline_sheet(swatch, make_grid(swatch, trial.experiment.path.hold, swatch.width_m / cells));
}

// Of a fabric as stiff as parameters go, or as these trials' if that is stiffer. A search that leaves what fabrics are
// would else ask for steps so short that one of its sets takes longer than all others.
double shortest_step_s(const cloth::spline::SplineSheet& sheet, const std::vector<ObservedTrial>& trials) {
  constexpr double kShare = 0.25;
  std::vector<cloth::Experiment> stiffest;
  for (const ObservedTrial& trial : trials) {
    stiffest.push_back(trial.experiment);
    double& stretch = stiffest.back().material.stretch;
    stretch = std::max(stretch, cloth::material_parameter("stretch").upper);
  }
  return kShare * cloth::spline::common_step_s(sheet, stiffest);
}

}  // namespace

int cells_of_bending_length(const ObservedTrial& trial, const std::vector<Parameter>& parameters,
                            const Eigen::VectorXd& coordinates) {
  Prediction p;
  p.experiment = trial.experiment;
  for (size_t k = 0; k < parameters.size(); ++k)
    parameters[k].apply(p, to_value(parameters[k], coordinates(static_cast<Index>(k))));
  const double length_m = cloth::spline::bending_length_m(p.experiment.material, p.experiment.gravity_m_s2.norm());
  return static_cast<int>(std::ceil(std::min(trial.width_m / length_m, 1e6) - 1e-9));
}

Simulation::Simulation(std::vector<ObservedTrial> trials, const SimulationOptions& options)
    : sheet_(sheet_for(trials.front(), options.cells)), view_(sheet_), rim_(observe::rim_of(view_.mesh())),
      options_(options), trials_(std::move(trials)) {
  options_.sheet.shortest_step_s = shortest_step_s(sheet_, trials_);
  for (const ObservedTrial& trial : trials_) {
    std::vector<cloth::SurfacePoint> points;
    std::shared_ptr<const cloth::GuideTrack> track;
    if (trial.markers) {
      for (const Eigen::Vector2d& uv : trial.markers->uv) points.push_back(surface_point(sheet_, uv));
      Prediction neutral;
      neutral.experiment = trial.experiment;
      track = guide_track(sheet_, trial, points, neutral);
    }
    marker_points_.push_back(std::move(points));
    guide_tracks_.push_back(std::move(track));
  }
}

State Simulation::state_at(const std::vector<Parameter>& parameters, const Eigen::VectorXd& coordinates,
                           double nudging_per_s) const {
  State none;
  none.branch.resize(trials_.size());
  none.nudging_per_s.assign(trials_.size(), nudging_per_s);
  State out = none;
  tbb::parallel_for(size_t{0}, trials_.size(),
                    [&](size_t i) { out.branch[i] = branch_of(none, i, parameters, coordinates); });
  lead_in(out, parameters, coordinates);
  return out;
}

State Simulation::state_of(const Simulation& other, const State& there) const {
  State out;
  out.branch.resize(trials_.size());
  out.nudging_per_s = there.nudging_per_s;
  out.let_go = there.let_go;
  take_branches(out, other, there);
  for (const Underway& u : there.underway) {
    const auto here = [&](const Eigen::Matrix3Xd& control) {
      return control.cols() > 0 ? carried_over(other.sheet(), control, sheet_) : control;
    };
    out.underway.push_back({here(u.position), here(u.velocity), u.grips});
  }
  return out;
}

void Simulation::take_branches(State& state, const Simulation& other, const State& there,
                               const std::vector<size_t>& trials) const {
  for (const size_t i : all_or(trials)) state.branch[i] = carried_over(other.sheet(), there.branch[i], sheet_);
}

void Simulation::take_branches(State& state, const std::vector<Eigen::Matrix3Xd>& shapes) const {
  for (size_t i = 0; i < trials_.size(); ++i)
    if (i < shapes.size() && shapes[i].cols() == sheet_.count() && shapes[i].allFinite()) state.branch[i] = shapes[i];
}

std::vector<size_t> Simulation::all_or(const std::vector<size_t>& wanted) const {
  return wanted.empty() ? all_of(trials_.size()) : wanted;
}

std::shared_ptr<const cloth::GuideTrack> Simulation::track_of(size_t trial, const Prediction& prediction) const {
  const observe::SensorModel& s = prediction.sensor;
  const bool as_seen = s.delay_s == 0 && s.turn_rad.isZero(0) && s.shift_m.isZero(0) && s.depth_bias == 0 &&
                       s.outline_jitter == 0 && s.outline_erosion_m == 0;
  return as_seen ? guide_tracks_[trial] : guide_track(sheet_, trials_[trial], marker_points_[trial], prediction);
}

std::vector<Prediction> Simulation::predictions(const State& state, const std::vector<Parameter>& parameters,
                                                const Eigen::MatrixXd& coordinates, size_t trial, Index first,
                                                Index count) const {
  std::vector<Prediction> out;
  for (Index set = first; set < first + count; ++set) {
    Prediction p;
    p.experiment = trials_[trial].experiment;
    p.experiment.start_shape = state.branch[trial];
    for (size_t k = 0; k < parameters.size(); ++k)
      parameters[k].apply(p, to_value(parameters[k], coordinates(static_cast<Index>(k), set)));
    // In the stamps' clock a camera that lags is a path that comes later: then nothing else moves in time.
    for (double& t : p.experiment.path.time_s) t += p.sensor.delay_s;
    if (state.is_underway(trial)) {
      const Underway& begins = state.underway[trial];
      p.experiment.start_shape = begins.position_held_at(p.experiment.path.at(p.experiment.start_s));
      p.experiment.start_velocity = begins.velocity;
      p.experiment.starts_at_rest = false;
    }
    if (state.nudging_per_s[trial] > 0 && guide_tracks_[trial]) {
      cloth::LetGo let_go = state.let_go;
      let_go.held_s = trials_[trial].lead_s;
      p.experiment.guide = std::make_shared<cloth::Guide>(cloth::Guide{
          track_of(trial, p), state.nudging_per_s[trial], p.experiment.start_s, let_go, stamps_of(trials_[trial], p)});
    }
    out.push_back(std::move(p));
  }
  return out;
}

Eigen::VectorXd Simulation::residual_of(size_t index, const ObservedTrial& trial, const Prediction& prediction,
                                        const cloth::Trajectory& trajectory) const {
  Eigen::VectorXd r(residual_count(trial));
  const cloth::Experiment& e = prediction.experiment;
  Index at = 0;
  if (trial.markers) {
    const Eigen::Matrix3Xd off =
        1e3 * (seen_markers(sheet_, trial, marker_points_[index], prediction, trajectory) - trial.markers->position);
    at = off.size();
    r.head(at) = off.reshaped();
  }
  const observe::StampDrift stamps = stamp_drift(trial, prediction);
  if (trial.stripes)
    for (const observe::StripeFrame& frame : trial.stripes->frames) {
      const auto residuals_at = [&](double t, double* out) {
        stripe_residuals(*trial.stripes, frame, view_.mesh(), rim_,
                         view_.of(position_at(e, trajectory, stamps.shown_at(t))), prediction.sensor, out);
      };
      const double rolling_s = prediction.sensor.row_delay_s;
      residuals_at(frame.time_s - 0.5 * rolling_s, r.data() + at);
      if (rolling_s != 0) {
        // Rows between the first and the last lie between the two times.
        const Index points = frame.points();
        Eigen::VectorXd last(points);
        residuals_at(frame.time_s + 0.5 * rolling_s, last.data());
        for (Index k = 0; k < points; ++k) {
          const auto i = static_cast<size_t>(k);
          const double row =
              i < frame.depth.size() ? frame.depth[i].pixel.y() : frame.outline[i - frame.depth.size()].pixel.y();
          const double share = row / trial.stripes->camera.height_px;
          r(at + k) = (1 - share) * r(at + k) + share * last(k);
        }
      }
      at += frame.points();
    }
  return r;
}

Prediction Simulation::prediction_of(const Call& call, const Run& run) const {
  return predictions(call.asked[run.asked].state, call.parameters, call.coordinates, run.trial, run.set, 1).front();
}

double Simulation::common_step_s(const Call& call, const std::vector<Run>& runs) const {
  std::vector<cloth::Experiment> lanes;
  for (const Run& run : runs)
    if (!trials_[run.trial].still) lanes.push_back(prediction_of(call, run).experiment);
  return lanes.empty() ? 0 : cloth::spline::common_step_s(sheet_, lanes, options_.sheet);
}

std::vector<cloth::Rest> Simulation::relaxed(const std::vector<cloth::Experiment>& lanes) const {
  if (!options_.simulator) return relax(sheet_, lanes, options_.sheet);
  std::vector<cloth::Experiment> still = lanes;
  for (cloth::Experiment& lane : still) lane.sample_s = {lane.start_s};
  std::vector<cloth::Rest> rests;
  for (cloth::Trajectory& run : options_.simulator->simulate(sheet_, still))
    rests.push_back({std::move(run.start), run.at_rest});
  return rests;
}

std::vector<cloth::Trajectory> Simulation::simulated(const std::vector<cloth::Experiment>& lanes, double step_s) const {
  if (options_.simulator) return options_.simulator->simulate(sheet_, lanes);
  cloth::spline::Options how = options_.sheet;
  if (step_s > 0) how.step_s = step_s;
  return simulate(sheet_, lanes, how);
}

std::vector<cloth::Trajectory> Simulation::trajectories_of(const Call& call, const std::vector<Run>& runs,
                                                           const std::vector<Prediction>& predicted) const {
  std::vector<cloth::Experiment> moving;
  if (!begins_at_shapes()) {
    for (const Prediction& p : predicted) moving.push_back(p.experiment);
    return simulated(moving);
  }
  std::vector<cloth::Rest> rests = rests_of(call, runs, predicted);
  std::vector<cloth::Trajectory> trajectories(runs.size());
  std::vector<size_t> moving_runs;
  for (size_t i = 0; i < runs.size(); ++i) {
    if (trials_[runs[i].trial].still) {
      const bool finite = rests[i].position.allFinite();
      trajectories[i] = {{rests[i].position}, rests[i].position, rests[i].at_rest, finite};
      continue;
    }
    moving.push_back(predicted[i].experiment);
    moving.back().start_shape = std::move(rests[i].position);
    moving.back().starts_at_rest = false;
    moving_runs.push_back(i);
  }
  std::vector<cloth::Trajectory> moved = simulated(moving, call.step_s);
  for (size_t k = 0; k < moved.size(); ++k) trajectories[moving_runs[k]] = std::move(moved[k]);
  return trajectories;
}

void Simulation::evaluate_runs(Call& call, const std::vector<Run>& runs) const {
  std::vector<Prediction> predicted;
  for (const Run& run : runs) predicted.push_back(prediction_of(call, run));
  const std::vector<cloth::Trajectory> trajectories = trajectories_of(call, runs, predicted);
  tbb::parallel_for(size_t{0}, runs.size(), [&](size_t i) {
    const size_t trial = runs[i].trial;
    Residuals& r = call.of(runs[i]);
    if (!trajectories[i].finite) return;
    r.start[trial] = trajectories[i].start;
    r.mm[trial] = residual_of(trial, trials_[trial], predicted[i], trajectories[i]);
    const std::vector<Eigen::VectorXd>& correction_mm = call.asked[runs[i].asked].state.grid_correction_mm;
    if (!correction_mm.empty()) r.mm[trial] += (1 + predicted[i].beyond_mesh) * correction_mm[trial];
  });
  for (const Run& run : runs) cloth::throw_if_stopped(trials_[run.trial].experiment.stop);
}

void Simulation::evaluate_on_ranks(Call& call, const std::vector<Run>& runs) const {
  call.step_s = common_step_s(call, runs);
  const auto most = static_cast<size_t>(cloth::spline::most_lanes(options_.sheet.precision));
  std::vector<Group> groups;
  for (size_t i = 0; i < runs.size(); i += most)
    groups.emplace_back(runs.begin() + static_cast<std::ptrdiff_t>(i),
                        runs.begin() + static_cast<std::ptrdiff_t>(std::min(i + most, runs.size())));
  const Eigen::MatrixXd& coordinates = call.coordinates;
  const auto put_group = [&](std::string& bytes, const Group& g) {
    for (const Run& run : g) {
      const Residuals& r = call.of(run);
      put(bytes, r.mm[run.trial].data(), r.mm[run.trial].size());
      put(bytes, r.start[run.trial].data(), r.start[run.trial].size());
    }
  };
  // A share: which groups, and at which coordinates; a rank whose own are others must not answer.
  const auto compute = [&](const std::string& share) {
    TakenBytes in(share);
    require(in, Batch::residuals);
    if (in.numbers() != coordinates.reshaped())
      throw std::runtime_error("ranks: this rank has come to other parameters than the first");
    std::vector<Group> mine;
    std::string bytes;
    while (!in.at_end()) mine.push_back(groups.at(in.number()));
    std::vector<Run> of_mine;
    for (const Group& g : mine) of_mine.insert(of_mine.end(), g.begin(), g.end());
    evaluate_runs(call, of_mine);
    for (const Group& g : mine) put_group(bytes, g);
    return bytes;
  };
  const auto take = [&](TakenBytes& in, const Group& g) {
    for (const Run& run : g) {
      Residuals& r = call.of(run);
      r.mm[run.trial] = in.numbers();
      r.start[run.trial] = in.numbers().reshaped(3, Eigen::AutoSize);
    }
  };
  Ranks& ranks = *options_.ranks;
  if (!ranks.is_first()) {
    const std::string bytes = ranks.follow(compute);
    TakenBytes in(bytes);
    for (const Group& g : groups) take(in, g);
    return;
  }
  const size_t parts = ranks.parts_of(groups.size(), 1);
  std::vector<std::string> shares(parts);
  for (std::string& share : shares) {
    put(share, static_cast<std::uint64_t>(Batch::residuals));
    put(share, coordinates.data(), coordinates.size());
  }
  for (size_t g = 0; g < groups.size(); ++g) put(shares[g % parts], g);
  const std::vector<std::string> results = ranks.share_out(shares, compute);
  std::vector<TakenBytes> in(results.begin(), results.end());
  for (size_t g = 0; g < groups.size(); ++g) take(in[g % parts], groups[g]);
  std::string all;
  for (const Group& g : groups) put_group(all, g);
  ranks.answer(all);
}

std::vector<std::vector<Residuals>> Simulation::evaluate(const std::vector<Asked>& asked,
                                                         const std::vector<Parameter>& parameters,
                                                         const Eigen::MatrixXd& coordinates) const {
  Residuals nothing;
  nothing.mm.resize(trials_.size());
  nothing.start.resize(trials_.size());
  const std::vector<Residuals> of_sets(static_cast<size_t>(coordinates.cols()), nothing);
  Call call{asked, parameters, coordinates, {asked.size(), of_sets}};
  std::vector<Run> runs;
  for (size_t a = 0; a < asked.size(); ++a)
    for (const size_t trial : all_or(asked[a].trials))
      for (Index set = 0; set < coordinates.cols(); ++set) runs.push_back({a, trial, set});
  if (runs.empty()) return std::move(call.out);
  if (options_.ranks && !options_.ranks->is_busy()) evaluate_on_ranks(call, runs);
  else evaluate_runs(call, runs);
  for (const Run& run : runs)
    if (Residuals& r = call.of(run); r.start[run.trial].cols() == 0) r.finite = false;
  return std::move(call.out);
}

std::vector<Residuals> Simulation::evaluate(const State& state, const std::vector<Parameter>& parameters,
                                            const Eigen::MatrixXd& coordinates,
                                            const std::vector<size_t>& trials) const {
  return evaluate({{state, trials}}, parameters, coordinates).front();
}

cloth::Trajectory Simulation::trajectory(const State& state, const std::vector<Parameter>& parameters,
                                         const Eigen::VectorXd& coordinates, size_t trial) const {
  const std::vector<Prediction> p = predictions(state, parameters, coordinates, trial, 0, 1);
  return simulated({p.front().experiment}).front();
}

Eigen::VectorXd Simulation::sd_mm(size_t trial) const {
  const ObservedTrial& t = trials_[trial];
  Eigen::VectorXd sd(residual_count(t));
  Index at = 0;
  const double floor = options_.model_sd_mm;
  if (t.markers) {
    sd.head(3 * t.markers->position.cols()).setConstant(std::hypot(1e3 * t.markers->noise_m, floor));
    at += 3 * t.markers->position.cols();
  }
  if (t.stripes)
    for (const observe::StripeFrame& f : t.stripes->frames) {
      for (const observe::DepthPoint& p : f.depth) sd(at++) = std::hypot(p.sd_mm, floor);
      for (const observe::OutlinePoint& p : f.outline) sd(at++) = std::hypot(p.sd_mm, floor);
    }
  return sd;
}

Eigen::VectorXd Simulation::time_s(size_t trial) const {
  const ObservedTrial& t = trials_[trial];
  Eigen::VectorXd time(residual_count(t));
  Index at = 0;
  if (t.markers)
    for (size_t k = 0; k < t.markers->uv.size(); ++k)
      for (const double s : t.markers->time_s)
        for (int axis = 0; axis < 3; ++axis) time(at++) = s;
  if (t.stripes)
    for (const observe::StripeFrame& f : t.stripes->frames)
      for (Index k = 0; k < f.points(); ++k) time(at++) = f.time_s;
  return time;
}

}  // namespace selvedge::model
