#include "station/simulator/foreign_simulator.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "cloth/spline/interpolation.h"
#include "files/bad_input.h"

namespace selvedge::station {

using Eigen::Index;
using Eigen::Matrix3Xd;

namespace {

static_assert(std::endian::native == std::endian::little, "floats of answers are little-endian");

constexpr size_t kMostTrials = 64;  // that a simulator is asked to keep; then numbers are used again

// Where the greville_points of a shape lie.
Matrix3Xd places_of(const cloth::spline::SplineSheet& sheet, const Matrix3Xd& control) {
  const std::vector<Eigen::Vector2d> points = greville_points(sheet);
  Matrix3Xd places(3, control.cols());
  for (Index i = 0; i < places.cols(); ++i)
    places.col(i) = position_of(surface_point(sheet, points[static_cast<size_t>(i)]), control);
  return places;
}

cloth::Trajectory trajectory_through(const cloth::spline::Interpolation& through, Index points, size_t times,
                                     const ForeignPositions& answer) {
  cloth::Trajectory out;
  out.finite = answer.error.empty();
  if (!out.finite) {
    out.start = Matrix3Xd::Constant(3, points, std::numeric_limits<double>::quiet_NaN());
    return out;
  }
  out.samples.reserve(times);
  for (size_t t = 0; t < times; ++t) {
    const double* first = answer.numbers.data() + t * static_cast<size_t>(3 * points);
    out.samples.emplace_back(Eigen::Map<const Matrix3Xd>(first, 3, points));
    through.solve(out.samples.back());
  }
  out.start = out.samples.front();
  return out;
}

}  // namespace

SimulatorTrial simulator_trial(const cloth::spline::SplineSheet& sheet, const cloth::Experiment& e) {
  if (e.sample_s.empty() || e.sample_s.front() != e.start_s)
    throw std::invalid_argument("simulator_trial: expected the first sample at start_s");
  if (e.guide) throw std::invalid_argument("simulator_trial: found a guide, which other simulators do not have");
  SimulatorTrial out;
  out.width_m = sheet.swatch.width_m;
  out.height_m = sheet.swatch.height_m;
  out.mass_kg = e.material.density * out.width_m * out.height_m;
  out.hold = e.path.hold;
  out.clamp_direction = e.path.clamp_direction;
  out.grip_s = e.path.time_s;
  out.left = e.path.left;
  out.right = e.path.right;
  out.gravity_m_s2 = e.gravity_m_s2;
  out.start_s = e.start_s;
  out.points = greville_points(sheet);
  out.time_s = e.sample_s;
  return out;
}

ForeignProcess::ForeignProcess(std::string name, const std::string& command, const ForeignOptions& options)
    : name_(std::move(name)), talk_(name_, command, options.log), limit_s_(options.run_limit_s) {}

const SimulatorHello& ForeignProcess::hello() {
  constexpr size_t kLongest = 1 << 20;
  if (!hello_) hello_ = std::make_unique<SimulatorHello>(hello_from(talk_.line(within(limit_s_), kLongest), name_));
  return *hello_;
}

std::vector<ForeignPositions> ForeignProcess::run(const std::vector<std::shared_ptr<const SimulatorTrial>>& trials,
                                                  std::vector<SimulatorRun> runs) {
  if (const size_t unread = talk_.unread())
    refuse(name_, "wrote {} bytes more than it was asked for, expected one answer a run", unread);
  told_.resize(std::max(told_.size(), trials.size()));
  for (size_t i = 0; i < runs.size(); ++i) {
    const auto at = static_cast<size_t>(runs[i].trial);
    if (told_[at] != trials[at]) talk_.tell(trial_line(runs[i].trial, *trials[at]) + '\n');
    told_[at] = trials[at];
    runs[i].number = next_run_++;
    runs[i].more = i + 1 < runs.size();
    talk_.tell(run_line(runs[i]) + '\n');
  }
  const TalkDeadline deadline = within(limit_s_ * static_cast<double>(runs.size()));
  std::vector<ForeignPositions> out;
  for (const SimulatorRun& run : runs) out.push_back(answer_to(run, *trials[static_cast<size_t>(run.trial)], deadline));
  return out;
}

ForeignPositions ForeignProcess::answer_to(const SimulatorRun& run, const SimulatorTrial& trial,
                                           TalkDeadline deadline) {
  constexpr size_t kLongestNumber = 32, kLongestError = 1 << 16;
  const size_t numbers = 3 * trial.points.size() * trial.time_s.size();
  SimulatorAnswer head = answer_from(talk_.line(deadline, kLongestError + kLongestNumber * numbers), name_, trial);
  if (head.run != run.number) refuse(name_, "answered run {}, expected the answer to run {}", head.run, run.number);
  if (head.doubles > 0) {
    head.positions.resize(head.doubles);
    talk_.bytes(reinterpret_cast<char*>(head.positions.data()), sizeof(double) * head.doubles, deadline);
  }
  if (head.floats > 0) {
    std::vector<float> singles(head.floats);
    talk_.bytes(reinterpret_cast<char*>(singles.data()), sizeof(float) * head.floats, deadline);
    head.positions.assign(singles.begin(), singles.end());
  }
  for (size_t i = 0; i < head.positions.size(); ++i)
    if (!std::isfinite(head.positions[i])) {
      const size_t point = i / 3 % trial.points.size(), time = i / 3 / trial.points.size();
      refuse(name_,
             "answered {} at {:.4g} s for the point ({:.4g}, {:.4g}), expected metres (a run that diverged is answered "
             "with {{\"run\": {}, \"error\": \"…\"}})",
             head.positions[i], trial.time_s[time], trial.points[point].x(), trial.points[point].y(), run.number);
    }
  return {std::move(head.positions), std::move(head.error)};
}

ForeignSimulator::ForeignSimulator(const std::string& command, const ForeignOptions& options) : command_(command) {
  const auto start = [&] { processes_.push_back(std::make_unique<ForeignProcess>("simulator", command, options)); };
  start();
  hello_ = processes_.front()->hello();
  int count = options.processes > 0 ? options.processes : tbb::this_task_arena::max_concurrency();
  if (hello_.processes > 0) count = std::min(count, hello_.processes);
  while (static_cast<int>(processes_.size()) < count) start();
  for (const auto& process : processes_) {
    if (hello_line(process->hello()) != hello_line(hello_))
      refuse("simulator", "two processes of it say different things at first, expected the same");
    free_.push_back(process.get());
  }
}

ForeignSimulator::~ForeignSimulator() = default;

std::string ForeignSimulator::name() const {
  return hello_.version.empty() ? hello_.name : hello_.name + " " + hello_.version;
}

std::string ForeignSimulator::identity() const { return command_ + " " + hello_line(hello_); }

std::vector<model::Parameter> ForeignSimulator::parameters() const {
  constexpr double kPartOfRange = 0.1;  // a change that matters, of a parameter that is not fitted as its logarithm
  std::vector<model::Parameter> out;
  for (const SimulatorParameter& said : hello_.parameters) {
    model::Parameter& p = out.emplace_back();
    p.name = said.name;
    p.unit = said.unit;
    p.start = said.usual;
    p.lower = said.lower;
    p.upper = said.upper;
    p.logarithmic = said.logarithmic;
    p.scale = kPartOfRange * (said.upper - said.lower);
    p.apply = [name = said.name](model::Prediction& prediction, double value) {
      prediction.experiment.simulator_values[name] = value;
    };
    p.at_rest = !said.motion_only;
    p.tried = said.tried;
  }
  return out;
}

std::string ForeignSimulator::last_divergence() const {
  const std::scoped_lock lock(mutex_);
  return last_divergence_;
}

// A trial that was asked about before keeps its number.
int ForeignSimulator::number_of(SimulatorTrial trial) const {
  const std::scoped_lock lock(mutex_);
  const auto same = std::find_if(trials_.begin(), trials_.end(), [&](const auto& known) { return *known == trial; });
  if (same != trials_.end()) return static_cast<int>(same - trials_.begin());
  const size_t at = next_trial_++ % kMostTrials;
  trials_.resize(std::max(trials_.size(), at + 1));
  trials_[at] = std::make_shared<const SimulatorTrial>(std::move(trial));
  return static_cast<int>(at);
}

SimulatorRun ForeignSimulator::run_of(const cloth::spline::SplineSheet& sheet, const cloth::Experiment& lane) const {
  if (std::find(hello_.holds.begin(), hello_.holds.end(), lane.path.hold) == hello_.holds.end())
    refuse("simulator", "{} cannot hold a fabric by {}, expected a simulator that can hold it as these trials do",
           name(), to_text(lane.path.hold));
  SimulatorRun run;
  run.trial = number_of(simulator_trial(sheet, lane));
  for (const SimulatorParameter& p : hello_.parameters) run.parameters[p.name] = p.usual;
  for (const auto& [name, value] : lane.simulator_values) run.parameters[name] = value;
  if (hello_.start_shape) run.start = places_of(sheet, lane.start_shape);
  run.hangs = lane.starts_at_rest;
  return run;
}

std::vector<ForeignPositions> ForeignSimulator::run_on_a_process(std::vector<SimulatorRun> runs) const {
  std::unique_lock lock(mutex_);
  freed_.wait(lock, [&] { return !free_.empty(); });
  ForeignProcess* const process = free_.back();
  free_.pop_back();
  const std::vector<std::shared_ptr<const SimulatorTrial>> trials = trials_;
  lock.unlock();
  // One that broke the protocol is given back too: who waits for it must not wait for ever, and finds it broken.
  const auto give_back = [&](void*) {
    const std::scoped_lock again(mutex_);
    free_.push_back(process);
    freed_.notify_one();
  };
  const std::unique_ptr<void, decltype(give_back)> taken(process, give_back);
  return process->run(trials, std::move(runs));
}

std::vector<cloth::Trajectory> ForeignSimulator::simulate(const cloth::spline::SplineSheet& sheet,
                                                          const std::vector<cloth::Experiment>& lanes) const {
  const cloth::spline::Interpolation through(sheet.u.basis, sheet.v.basis);
  std::vector<ForeignPositions> answers(lanes.size(), {{}, "it was to begin where another run of it diverged"});
  std::vector<SimulatorRun> runs;
  std::vector<size_t> asked;
  for (size_t i = 0; i < lanes.size(); ++i) {
    if (hello_.start_shape && !lanes[i].start_shape.allFinite()) continue;
    runs.push_back(run_of(sheet, lanes[i]));
    asked.push_back(i);
  }
  const auto at_once = static_cast<size_t>(hello_.at_once);
  tbb::parallel_for(size_t{0}, (runs.size() + at_once - 1) / at_once, [&](size_t group) {
    const size_t first = group * at_once, end = std::min(first + at_once, runs.size());
    std::vector<ForeignPositions> some =
        run_on_a_process({runs.begin() + static_cast<Index>(first), runs.begin() + static_cast<Index>(end)});
    for (size_t i = first; i < end; ++i) answers[asked[i]] = std::move(some[i - first]);
  });
  std::vector<cloth::Trajectory> out(lanes.size());
  tbb::parallel_for(size_t{0}, lanes.size(), [&](size_t i) {
    out[i] = trajectory_through(through, sheet.count(), lanes[i].sample_s.size(), answers[i]);
    if (out[i].finite) return;
    const std::scoped_lock lock(mutex_);
    last_divergence_ = answers[i].error;
  });
  return out;
}

}  // namespace selvedge::station
