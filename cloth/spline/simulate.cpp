#include "cloth/spline/simulate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "cloth/kernel/force_field.h"
#include "cloth/kernel/processor.h"
#include "cloth/spline/lane_run.h"
#include "cloth/spline/settle.h"
#include "cloth/spline/spectrum.h"
#include "cloth/start_shape.h"

namespace selvedge::cloth::spline {

namespace {

using Stages = cloth::kernel::DampingStages;

void check_lanes(const std::vector<Experiment>& lanes) {
  for (const Experiment& e : lanes) {
    if (e.make_step_filter) throw std::invalid_argument("spline::simulate: contact is for triangles");
    if (e.path.hold != lanes[0].path.hold)
      throw std::invalid_argument("spline::simulate: lanes must share the way of holding");
  }
}

// Forces on control points over the steps until they act again.
template <class T>
void push(LaneRun<T>& run, size_t lane, const Eigen::Matrix3Xd& force, double steps) {
  for (Eigen::Index i = 0; i < force.cols(); ++i)
    if (!force.col(i).isZero(0)) run.push(lane, static_cast<int>(i), steps * force.col(i));
}

// The pull of a guide on one lane over the steps until it acts again.
template <class T>
void pull(LaneRun<T>& run, size_t lane, const SplineSheet& sheet, const Experiment& e, double t_s, double steps) {
  if (e.guide->let_go.is_free(t_s - e.guide->start_s)) return;
  const Eigen::Matrix3Xd x = run.position(lane), v = run.velocity(lane);
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, x.cols());
  add_nudging(*e.guide, e.material.density * sheet.swatch.width_m * sheet.swatch.height_m, t_s, x.data(), v.data(),
              force.data());
  push(run, lane, force, steps);
}

double duration_s(const Experiment& e) { return e.sample_s.empty() ? 0 : std::max(0.0, e.sample_s.back() - e.start_s); }

int steps_of(const Experiment& e, double step_s) { return static_cast<int>(std::ceil(duration_s(e) / step_s - 1e-9)); }

// Keeps the samples of one lane while it goes on.
class Sampler {
 public:
  Sampler(const Experiment& e, Trajectory& out) : wanted_(e.sample_s), out_(out) { out_.samples.clear(); }
  bool wants(double until_s) const { return next_ < wanted_.size() && wanted_[next_] <= until_s + 1e-12; }
  void keep(double from_s, double to_s, const Eigen::Matrix3Xd& before, const Eigen::Matrix3Xd& now) {
    for (; wants(to_s); ++next_) {
      const double share = to_s > from_s ? std::clamp((wanted_[next_] - from_s) / (to_s - from_s), 0.0, 1.0) : 1.0;
      out_.samples.push_back(before + share * (now - before));
    }
  }

 private:
  const std::vector<double>& wanted_;
  Trajectory& out_;
  size_t next_ = 0;
};

// Runs a group from its starts in `out` and fills in the samples. A lane that is over goes on unheeded until the
// longest is.
template <class T>
void run_group(const SplineSheet& sheet, const std::vector<const Experiment*>& lanes, double step_s,
               const Stages& stages, const std::vector<Trajectory*>& out) {
  LaneRun<T> run(sheet, lanes);
  run.plan(step_s, stages);
  std::vector<Sampler> samplers;
  std::vector<int> steps;
  std::vector<Eigen::Matrix<double, 3, 2>> corners, ahead;
  std::vector<Eigen::Matrix3Xd> smooth;
  for (size_t i = 0; i < lanes.size(); ++i) {
    const Experiment& e = *lanes[i];
    run.set_position(i, out[i]->start);
    if (!e.starts_at_rest && e.start_velocity.cols() > 0) run.set_velocity(i, e.start_velocity);
    samplers.emplace_back(e, *out[i]);
    samplers[i].keep(e.start_s, e.start_s, out[i]->start, out[i]->start);
    steps.push_back(steps_of(e, step_s));
    corners.push_back(e.path.at(e.start_s));
    smooth.push_back(smooth_forces_on(sheet, e));
  }
  if (run.has_memory()) run.set_forces(cloth::kernel::kBroughtFromFlat);
  const int pull_every = std::max(1, static_cast<int>(kNudgeEvery_s / step_s));
  std::vector<Eigen::Matrix3Xd> before(lanes.size());
  for (int step = 0; step < *std::max_element(steps.begin(), steps.end()); ++step) {
    run.set_forces(step_s);
    ahead.clear();
    for (size_t i = 0; i < lanes.size(); ++i) {
      const Experiment& e = *lanes[i];
      cloth::throw_if_stopped(e.stop);
      const double from = e.start_s + step * step_s, to = e.start_s + (step + 1) * step_s;
      ahead.push_back(e.path.at(to));
      run.hold(i, e.path, corners[i], ahead[i]);
      if (step >= steps[i]) continue;
      if (step % pull_every == 0) push(run, i, smooth[i], pull_every);
      if (e.guide && step % pull_every == 0) pull(run, i, sheet, e, from, pull_every);
      if (samplers[i].wants(to)) before[i] = run.position(i);
    }
    std::swap(corners, ahead);
    run.advance();
    for (size_t i = 0; i < lanes.size(); ++i) {
      const double from = lanes[i]->start_s + step * step_s, to = lanes[i]->start_s + (step + 1) * step_s;
      if (step < steps[i] && samplers[i].wants(to)) samplers[i].keep(from, to, before[i], run.position(i));
      if (step + 1 == steps[i]) out[i]->end_velocity = run.velocity(i);
    }
  }
  for (size_t i = 0; i < lanes.size(); ++i) {
    if (samplers[i].wants(std::numeric_limits<double>::max())) {  // what rounding left beyond the last step
      const Eigen::Matrix3Xd now = run.position(i);
      samplers[i].keep(0, std::numeric_limits<double>::max(), now, now);
    }
    out[i]->finite = std::all_of(out[i]->samples.begin(), out[i]->samples.end(),
                                 [](const Eigen::Matrix3Xd& x) { return x.allFinite(); });
  }
}

void run_group(const SplineSheet& sheet, const std::vector<const Experiment*>& lanes, Precision precision,
               double step_s, const Stages& stages, const std::vector<Trajectory*>& out) {
  if (precision == Precision::single) run_group<float>(sheet, lanes, step_s, stages, out);
  else run_group<double>(sheet, lanes, step_s, stages, out);
}

// Where groups do not come out even among the threads, the largest are halved, for somebody is idle else: half a vector
// of AVX-512 takes six tenths of the time. Half of a narrower one takes as long as the whole.
void halve_for_idle_threads(std::vector<std::vector<size_t>>& groups, size_t most) {
  if (cloth::kernel::vector_bytes() < 64) return;
  const size_t threads = std::min(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism),
                                  static_cast<size_t>(tbb::this_task_arena::max_concurrency()));
  for (size_t idle = (threads - groups.size() % threads) % threads; idle > 0; --idle) {
    const auto largest = std::max_element(groups.begin(), groups.end(),
                                          [](const auto& a, const auto& b) { return a.size() < b.size(); });
    if (largest == groups.end() || largest->size() <= most / 2) return;
    const auto middle = largest->begin() + static_cast<std::ptrdiff_t>((largest->size() + 1) / 2);
    std::vector<size_t> second(middle, largest->end());
    largest->erase(middle, largest->end());
    groups.push_back(std::move(second));
  }
}

// Those that take their steps alike, in groups that the kernels hold: what is dear for a lane is dear for its group, so
// such lanes go side by side; and long runs beside long ones. stages: of the lanes that are run.
std::vector<std::vector<size_t>> grouped(const std::vector<Experiment>& lanes, const std::map<size_t, Stages>& stages,
                                         size_t most) {
  std::map<std::pair<int, double>, std::vector<size_t>> alike;
  for (const auto& [i, plan] : stages) alike[{plan.count, plan.gain[0]}].push_back(i);
  std::vector<std::vector<size_t>> groups;
  for (auto& [key, members] : alike) {
    const auto order = [&](size_t i) { return std::pair(extras_of(lanes[i].material), -duration_s(lanes[i])); };
    std::stable_sort(members.begin(), members.end(), [&](size_t a, size_t b) { return order(a) < order(b); });
    for (size_t first = 0; first < members.size(); first += most)
      groups.emplace_back(members.begin() + static_cast<std::ptrdiff_t>(first),
                          members.begin() + static_cast<std::ptrdiff_t>(std::min(first + most, members.size())));
  }
  halve_for_idle_threads(groups, most);
  return groups;
}

// Of the planned step: strains beside the grips may exceed what the plan guesses.
constexpr double kShare = 0.8;

// The step of each lane by itself.
std::vector<double> steps_s(const std::vector<Spectrum>& spectra) {
  std::vector<double> out;
  for (const Spectrum& s : spectra) out.push_back(kShare * plan_step(s).step_s);
  return out;
}

// Of those that are run.
double least_step_s(const std::vector<double>& steps, const Options& options) {
  double least = std::numeric_limits<double>::infinity();
  for (const double step : steps)
    if (step >= options.shortest_step_s) least = std::min(least, step);
  return least;
}

void leave_out(const Experiment& lane, Trajectory& out) {
  out.samples.assign(lane.sample_s.size(),
                     Eigen::Matrix3Xd::Constant(3, out.start.cols(), std::numeric_limits<double>::quiet_NaN()));
  out.finite = false;
}

// After each parallel loop: where one of them throws, those that run beside it in the same outer loop return as if they
// were done.
void throw_if_stopped(const std::vector<Experiment>& lanes) {
  for (const Experiment& e : lanes) cloth::throw_if_stopped(e.stop);
}

std::vector<Spectrum> spectra_of(const SplineSheet& sheet, const std::vector<Experiment>& lanes) {
  std::vector<Material> materials;
  for (const Experiment& e : lanes) materials.push_back(e.material);
  std::vector<Spectrum> spectra = spectra_of(sheet, materials);
  throw_if_stopped(lanes);
  return spectra;
}

// Each lane where it begins.
std::vector<Trajectory> begun(const SplineSheet& sheet, const std::vector<Experiment>& lanes, const Options& options) {
  std::vector<Trajectory> out(lanes.size());
  std::vector<Experiment> at_rest;
  for (const Experiment& e : lanes)
    if (e.starts_at_rest) at_rest.push_back(e);
  std::vector<Rest> rests = relax(sheet, at_rest, options);
  auto rest = rests.begin();
  for (size_t i = 0; i < lanes.size(); ++i) {
    Rest begins = lanes[i].starts_at_rest ? std::move(*rest++) : Rest{lanes[i].start_shape};
    out[i].start = std::move(begins.position);
    out[i].at_rest = begins.at_rest;
  }
  return out;
}

}  // namespace

int most_lanes(Precision precision) {
  return precision == Precision::single ? kernel::most_lanes<float>() : kernel::most_lanes<double>();
}

double common_step_s(const SplineSheet& sheet, const std::vector<Experiment>& lanes, const Options& options) {
  return least_step_s(steps_s(spectra_of(sheet, lanes)), options);
}

std::vector<Rest> relax(const SplineSheet& sheet, const std::vector<Experiment>& lanes, const Options& options) {
  std::vector<Rest> rests(lanes.size());
  tbb::parallel_for(size_t{0}, lanes.size(), [&](size_t i) {
    Settled settled = settle(sheet, lanes[i], lanes[i].start_shape, options.rest_change_m);
    rests[i] = {std::move(settled.position), settled.at_rest};
  });
  throw_if_stopped(lanes);
  return rests;
}

std::vector<Trajectory> simulate(const SplineSheet& sheet, const std::vector<Experiment>& lanes,
                                 const Options& options) {
  check_lanes(lanes);
  std::vector<Trajectory> out = begun(sheet, lanes, options);
  const std::vector<Spectrum> spectra = spectra_of(sheet, lanes);
  const std::vector<double> steps = steps_s(spectra);
  const double step_s = options.step_s > 0 ? options.step_s : least_step_s(steps, options);
  std::map<size_t, Stages> stages;
  for (size_t i = 0; i < lanes.size(); ++i) {
    if (steps[i] < options.shortest_step_s) leave_out(lanes[i], out[i]);
    else stages[i] = stages_for(spectra[i], step_s);
  }
  const auto groups = grouped(lanes, stages, static_cast<size_t>(most_lanes(options.precision)));
  const auto run = [&](const std::vector<size_t>& members, double h, const Stages& plan) {
    std::vector<const Experiment*> group;
    std::vector<Trajectory*> to;
    for (const size_t i : members) {
      group.push_back(&lanes[i]);
      to.push_back(&out[i]);
    }
    run_group(sheet, group, options.precision, h, plan, to);
  };
  tbb::parallel_for(size_t{0}, groups.size(), [&](size_t g) { run(groups[g], step_s, stages.at(groups[g][0])); });
  throw_if_stopped(lanes);
  for (const auto& [i, plan] : stages)
    for (double h = step_s / 2; !out[i].finite && h > step_s / 10; h /= 2) run({i}, h, stages_for(spectra[i], h));
  return out;
}

Eigen::Matrix3Xd hung_shape(const SplineSheet& sheet, const Experiment& e, double side) {
  return control_points_through(sheet, hung(e.path, e.start_s, e.gravity_m_s2, sheet.swatch.width_m, side));
}

}  // namespace selvedge::cloth::spline
