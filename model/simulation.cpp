#include "model/simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include <tbb/parallel_for.h>

#include "geometry/cubic.h"
#include "geometry/order_statistics.h"
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

// The two samples around a time and two more, for a cubic; clamped at the ends.
struct Between {
  size_t before = 0;
  double share = 0;
};

Between between(const std::vector<double>& sample_s, double t) {
  if (sample_s.size() < 2) return {};
  const double step = sample_s[1] - sample_s[0];
  const double at = std::clamp((t - sample_s[0]) / step, 0.0, static_cast<double>(sample_s.size() - 1) - 1e-9);
  return {static_cast<size_t>(at), at - std::floor(at)};
}

template <class Pick>
auto interpolated(const Between& b, size_t count, const Pick& pick) {
  const auto clamped = [&](std::ptrdiff_t i) {
    return pick(static_cast<size_t>(std::clamp<std::ptrdiff_t>(i, 0, static_cast<std::ptrdiff_t>(count) - 1)));
  };
  const auto i = static_cast<std::ptrdiff_t>(b.before);
  return geometry::catmull_rom(b.share, clamped(i - 1), clamped(i), clamped(i + 1), clamped(i + 2));
}

// The time at which the fabric was as an observation stamped t shows it.
double shown_at(const Prediction& p, double t) {
  return t - p.sensor.delay_s - p.sensor.drift * (t - p.experiment.start_s);
}

// A shape on one mesh, interpolated to the vertices of another.
Eigen::Matrix3Xd on_mesh(const geometry::TriangleMesh& to, const cloth::Sheet& from, const Eigen::Matrix3Xd& shape) {
  Eigen::Matrix3Xd out(3, static_cast<Index>(to.rest_uv.size()));
  for (size_t i = 0; i < to.rest_uv.size(); ++i)
    out.col(static_cast<Index>(i)) = position_of(cloth::surface_point(from, to.rest_uv[i]), shape);
  return out;
}

std::vector<size_t> all_of(size_t count) {
  std::vector<size_t> all(count);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

// Robust size of the residuals: median of their absolute values.
double median_absolute(const Eigen::VectorXd& r) {
  std::vector<double> seen;
  for (const double x : r)
    if (std::isfinite(x)) seen.push_back(std::abs(x));
  return seen.empty() ? std::numeric_limits<double>::infinity() : geometry::median(std::move(seen));
}

}  // namespace

Eigen::Matrix3Xd position_at(const cloth::Experiment& e, const cloth::Trajectory& trajectory, double t_s) {
  return interpolated(between(e.sample_s, t_s), trajectory.samples.size(),
                      [&](size_t i) -> const Eigen::Matrix3Xd { return trajectory.samples[i]; });
}

Simulation::Simulation(std::vector<ObservedTrial> trials, const SimulationOptions& options)
    : options_(options), trials_(std::move(trials)) {
  const double width = trials_.front().width_m, height = trials_.front().height_m;
  const int rows = std::max(3, static_cast<int>(std::lround((options.columns - 1) * height / width)) + 1);
  sheet_ = cloth::make_sheet(geometry::make_grid_mesh(width, height, options.columns, rows));
  for (const ObservedTrial& trial : trials_) {
    std::vector<cloth::SurfacePoint> points;
    std::shared_ptr<cloth::GuideTrack> track;
    if (trial.markers) {
      for (const Eigen::Vector2d& uv : trial.markers->uv) points.push_back(cloth::surface_point(sheet_, uv));
      track = std::make_shared<cloth::GuideTrack>(
          cloth::GuideTrack{points, trial.markers->time_s, trial.markers->position});
    }
    marker_points_.push_back(std::move(points));
    guide_tracks_.push_back(std::move(track));
  }
}

State Simulation::state_at(const std::vector<Parameter>& parameters, const Eigen::VectorXd& coordinates,
                           double nudging_per_s) const {
  State none{std::vector<Eigen::Matrix3Xd>(trials_.size()), std::vector<double>(trials_.size(), nudging_per_s), {}, {}};
  State out = none;
  tbb::parallel_for(size_t{0}, trials_.size(),
                    [&](size_t i) { out.branch[i] = branch_of(none, i, parameters, coordinates); });
  return out;
}

State Simulation::state_of(const Simulation& other, const State& there) const {
  State out{std::vector<Eigen::Matrix3Xd>(trials_.size()), there.nudging_per_s, there.let_go, {}};
  take_branches(out, other, there);
  return out;
}

void Simulation::take_branches(State& state, const Simulation& other, const State& there,
                               const std::vector<size_t>& trials) const {
  for (const size_t i : trials.empty() ? all_of(trials_.size()) : trials)
    state.branch[i] = on_mesh(sheet_.mesh, other.sheet(), there.branch[i]);
}

void Simulation::take_branches(State& state, const std::vector<Eigen::Matrix3Xd>& shapes) const {
  for (size_t i = 0; i < trials_.size(); ++i)
    if (i < shapes.size() && shapes[i].cols() == sheet_.data.vertex_count && shapes[i].allFinite())
      state.branch[i] = shapes[i];
}

std::vector<size_t> Simulation::simulated_of(const std::vector<size_t>& wanted) const {
  std::vector<size_t> trials = wanted.empty() ? all_of(trials_.size()) : wanted;
  if (options_.skipped_s > 0) std::erase_if(trials, [&](size_t trial) { return trials_[trial].still; });
  return trials;
}

bool Simulation::rematch(State& state, const std::vector<Parameter>& parameters, const Eigen::VectorXd& coordinates,
                         const std::vector<size_t>& wanted) const {
  const std::vector<size_t> trials = simulated_of(wanted);
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
    const auto times = static_cast<Index>(first.markers->time_s.size());
    Eigen::Matrix3Xd initial(3, static_cast<Index>(first.markers->uv.size()));
    for (Index k = 0; k < initial.cols(); ++k) initial.col(k) = first.markers->position.col(k * times);
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

Eigen::Matrix3Xd Simulation::branch_of(const State& state, size_t trial, const std::vector<Parameter>& parameters,
                                       const Eigen::VectorXd& coordinates) const {
  const ObservedTrial& seen = trials_[trial];
  const bool has_one = state.branch[trial].cols() > 0;
  std::vector<Eigen::Matrix3Xd> shapes;
  if (has_one) shapes.push_back(state.branch[trial]);
  for (const double side : {1.0, -1.0}) {
    const Eigen::Matrix3Xd hung = cloth::hung_shape(sheet_, seen.experiment, side);
    std::vector<Eigen::Vector2d> uv;
    if (seen.markers) {
      const observe::MarkerTrack& m = *seen.markers;
      const auto times = static_cast<Index>(m.time_s.size());
      uv = {{0, 0}, {seen.width_m, 0}};
      Eigen::Matrix3Xd at(3, static_cast<Index>(m.uv.size()) + 2);
      at.leftCols(2) = seen.experiment.path.at(seen.experiment.start_s);
      for (size_t k = 0; k < m.uv.size(); ++k) {
        const Eigen::Vector3d first = m.position.col(static_cast<Index>(k) * times);
        if (!first.allFinite()) continue;
        at.col(static_cast<Index>(uv.size())) = first;
        uv.push_back(m.uv[k]);
      }
      if (uv.size() >= 6)
        shapes.push_back(cloth::bent_through(sheet_, hung, uv, at.leftCols(static_cast<Index>(uv.size()))));
    }
    if (!has_one || uv.size() < 6) shapes.push_back(hung);
  }
  std::vector<cloth::Experiment> lanes;
  const Prediction common = predictions(state, parameters, Eigen::MatrixXd(coordinates), trial, 0, 1).front();
  for (const Eigen::Matrix3Xd& shape : shapes) {
    lanes.push_back(common.experiment);
    lanes.back().start_shape = shape;
  }
  const std::vector<cloth::Rest> rests = cloth::relax(sheet_, lanes, options_.cloth);
  // A tenth nearer, or the branch in use stays.
  constexpr double kClearly = 0.9;
  double least = std::numeric_limits<double>::infinity();
  Eigen::Matrix3Xd nearest = shapes.front();
  for (size_t i = 0; i < rests.size(); ++i) {
    // Bent through points that are centimetres off, a sheet may diverge in part; what is left of it may well lie near.
    if (!rests[i].position.allFinite()) continue;
    const double error = distance_at_first_sight_mm(trial, common, rests[i].position);
    if (error < least) {
      least = has_one && i == 0 ? kClearly * error : error;
      nearest = rests[i].position;
    }
  }
  return nearest;
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
    if (state.nudging_per_s[trial] > 0 && guide_tracks_[trial])
      p.experiment.guide = std::make_shared<cloth::Guide>(cloth::Guide{guide_tracks_[trial], state.nudging_per_s[trial],
                                                                       p.sensor.delay_s, p.sensor.drift,
                                                                       p.experiment.start_s, state.let_go});
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
    const std::vector<cloth::SurfacePoint>& points = marker_points_[index];
    const observe::MarkerTrack& m = *trial.markers;
    for (size_t k = 0; k < m.uv.size(); ++k)
      for (size_t j = 0; j < m.time_s.size(); ++j) {
        const Between b = between(e.sample_s, shown_at(prediction, m.time_s[j]));
        const Eigen::Vector3d x = interpolated(b, trajectory.samples.size(), [&](size_t i) -> Eigen::Vector3d {
          return position_of(points[k], trajectory.samples[i]);
        });
        r.segment<3>(at) = 1e3 * (x - m.position.col(static_cast<Index>(k * m.time_s.size() + j)));
        at += 3;
      }
  }
  if (trial.stripes)
    for (const observe::StripeFrame& frame : trial.stripes->frames) {
      const auto residuals_at = [&](double t, double* out) {
        stripe_residuals(*trial.stripes, frame, sheet_.mesh, position_at(e, trajectory, shown_at(prediction, t)),
                         prediction.sensor, out);
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

std::vector<Simulation::Group> Simulation::groups_of(const std::vector<size_t>& trials, Index sets) const {
  const Index lanes = cloth::kernel::most_lanes();
  std::vector<Group> groups;
  for (const size_t trial : trials)
    for (Index first = 0; first < sets; first += lanes) groups.push_back({trial, first, std::min(lanes, sets - first)});
  return groups;
}

std::map<std::pair<size_t, Index>, Eigen::Matrix3Xd> Simulation::shared_rests(const Call& call,
                                                                              const std::vector<Group>& groups) const {
  const auto& [state, parameters, coordinates, all] = call;
  // What acts on motion alone stands at its usual value, so that an equilibrium's bits do not depend on who shares it.
  Eigen::MatrixXd at_rest = coordinates;
  for (Index set = 0; set < at_rest.cols(); ++set) {
    // In a draught drag acts on what hangs still, too.
    if (!predictions(state, parameters, coordinates, 0, set, 1).front().experiment.air_velocity_m_s.isZero()) continue;
    for (size_t k = 0; k < parameters.size(); ++k)
      if (!parameters[k].at_rest)
        at_rest(static_cast<Index>(k), set) = to_coordinate(parameters[k], parameters[k].start);
  }
  std::map<size_t, std::vector<Index>> different;  // sets, by trial
  std::map<std::pair<size_t, Index>, Index> like;
  for (const Group& g : groups)
    for (Index set = g.first; set < g.first + g.count && !trials_[g.trial].still; ++set) {
      std::vector<Index>& known = different[g.trial];
      const auto same =
          std::find_if(known.begin(), known.end(), [&](Index other) { return at_rest.col(other) == at_rest.col(set); });
      like[{g.trial, set}] = same == known.end() ? set : *same;
      if (same == known.end()) known.push_back(set);
    }
  const auto lanes_at_once = static_cast<size_t>(cloth::kernel::most_lanes());
  std::vector<std::pair<size_t, std::vector<Index>>> tasks;
  for (const auto& [trial, sets] : different)
    for (size_t first = 0; first < sets.size(); first += lanes_at_once)
      tasks.push_back({trial,
                       {sets.begin() + static_cast<std::ptrdiff_t>(first),
                        sets.begin() + static_cast<std::ptrdiff_t>(std::min(first + lanes_at_once, sets.size()))}});
  std::vector<std::vector<cloth::Rest>> rests(tasks.size());
  tbb::parallel_for(size_t{0}, tasks.size(), [&](size_t i) {
    const auto& [trial, sets] = tasks[i];
    std::vector<cloth::Experiment> lanes;
    for (const Index set : sets)
      lanes.push_back(predictions(call.state, call.parameters, at_rest, trial, set, 1).front().experiment);
    rests[i] = cloth::relax(sheet_, lanes, options_.cloth);
  });
  std::map<std::pair<size_t, Index>, Eigen::Matrix3Xd> found, out;
  for (size_t i = 0; i < tasks.size(); ++i)
    for (size_t k = 0; k < tasks[i].second.size(); ++k)
      found[{tasks[i].first, tasks[i].second[k]}] = rests[i][k].position;
  for (const auto& [key, set] : like) out[key] = found.at({key.first, set});
  return out;
}

void Simulation::evaluate_groups(const Call& call, const std::vector<Group>& groups,
                                 std::vector<Residuals>& out) const {
  const auto rests =
      options_.shared_rests ? shared_rests(call, groups) : std::map<std::pair<size_t, Index>, Eigen::Matrix3Xd>{};
  tbb::parallel_for(size_t{0}, groups.size(), [&](size_t task) {
    const auto [trial, first, count] = groups[task];
    const std::vector<Prediction> predicted =
        predictions(call.state, call.parameters, call.coordinates, trial, first, count);
    std::vector<cloth::Experiment> lanes;
    for (Index i = 0; i < count; ++i) {
      lanes.push_back(predicted[static_cast<size_t>(i)].experiment);
      const auto rest = rests.find({trial, first + i});
      if (rest == rests.end()) continue;
      lanes.back().start_shape = rest->second;
      lanes.back().starts_at_rest = false;
    }
    std::vector<cloth::Trajectory> runs;
    if (trials_[trial].still) {
      for (cloth::Rest& rest : cloth::relax(sheet_, lanes, options_.cloth))
        runs.push_back({{rest.position}, rest.position, rest.at_rest, rest.position.allFinite()});
    } else {
      runs = cloth::simulate(sheet_, lanes, options_.cloth);
    }
    for (Index i = 0; i < count; ++i) {
      Residuals& r = out[static_cast<size_t>(first + i)];
      const cloth::Trajectory& run = runs[static_cast<size_t>(i)];
      if (!run.finite) continue;
      r.start[trial] = run.start;
      r.mm[trial] = residual_of(trial, trials_[trial], predicted[static_cast<size_t>(i)], run);
      if (!call.state.grid_correction_mm.empty())
        r.mm[trial] += (1 + predicted[static_cast<size_t>(i)].beyond_mesh) * call.state.grid_correction_mm[trial];
    }
  });
}

void Simulation::evaluate_on_ranks(const Call& call, std::vector<Residuals>& out) const {
  const Eigen::MatrixXd& coordinates = call.coordinates;
  const std::vector<Group>& groups = call.groups;
  const auto put_group = [&](std::string& bytes, const Group& g) {
    for (Index i = g.first; i < g.first + g.count; ++i) {
      const Residuals& r = out[static_cast<size_t>(i)];
      put(bytes, r.mm[g.trial].data(), r.mm[g.trial].size());
      put(bytes, r.start[g.trial].data(), r.start[g.trial].size());
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
    evaluate_groups(call, mine, out);
    for (const Group& g : mine) put_group(bytes, g);
    return bytes;
  };
  const auto take = [&](TakenBytes& in, const Group& g) {
    for (Index i = g.first; i < g.first + g.count; ++i) {
      Residuals& r = out[static_cast<size_t>(i)];
      r.mm[g.trial] = in.numbers();
      r.start[g.trial] = in.numbers().reshaped(3, Eigen::AutoSize);
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

std::vector<Residuals> Simulation::evaluate(const State& state, const std::vector<Parameter>& parameters,
                                            const Eigen::MatrixXd& coordinates,
                                            const std::vector<size_t>& wanted) const {
  const std::vector<size_t> trials = simulated_of(wanted);
  std::vector<Residuals> out(static_cast<size_t>(coordinates.cols()));
  for (Residuals& r : out) {
    r.mm.resize(trials_.size());
    r.start.resize(trials_.size());
  }
  const std::vector<Group> groups = groups_of(trials, coordinates.cols());
  const Call call{state, parameters, coordinates, groups};
  if (options_.ranks && !options_.ranks->is_busy()) evaluate_on_ranks(call, out);
  else evaluate_groups(call, groups, out);
  for (Residuals& r : out)
    for (const size_t trial : trials)
      if (r.start[trial].cols() == 0) r.finite = false;
  if (options_.skipped_s > 0)
    for (const size_t trial : trials) {
      const Eigen::VectorXd time = time_s(trial);
      for (Index i = 0; i < time.size(); ++i)
        if (is_skipped(trial, time(i)))
          for (Residuals& r : out)
            if (r.mm[trial].size() == time.size()) r.mm[trial](i) = std::numeric_limits<double>::quiet_NaN();
    }
  return out;
}

bool Simulation::is_skipped(size_t trial, double time_s) const {
  const ObservedTrial& t = trials_[trial];
  return options_.skipped_s > 0 && (t.still || time_s < t.experiment.start_s + options_.skipped_s);
}

cloth::Trajectory Simulation::trajectory(const State& state, const std::vector<Parameter>& parameters,
                                         const Eigen::VectorXd& coordinates, size_t trial) const {
  const std::vector<Prediction> p = predictions(state, parameters, coordinates, trial, 0, 1);
  return cloth::simulate(sheet_, {p.front().experiment}, options_.cloth).front();
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
