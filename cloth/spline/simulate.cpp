#include "cloth/spline/simulate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include <tbb/parallel_for.h>

#include "cloth/kernel/force_field.h"
#include "cloth/spline/lane_run.h"
#include "cloth/spline/settle.h"
#include "cloth/spline/spectrum.h"

namespace selvedge::cloth::spline {

namespace {

using Stages = cloth::kernel::DampingStages;

void check_lanes(const std::vector<Experiment>& lanes) {
  for (const Experiment& e : lanes) {
    if (e.make_step_filter) throw std::invalid_argument("spline::simulate: contact is for triangles");
    if (e.start_s != lanes[0].start_s || e.sample_s != lanes[0].sample_s || e.path.hold != lanes[0].path.hold ||
        !e.guide != !lanes[0].guide)
      throw std::invalid_argument(
          "spline::simulate: lanes must share start_s, sample_s, the way of holding, and a guide or none");
  }
}

// The pull of a guide on one lane over the steps until it acts again.
template <class T>
void pull(LaneRun<T>& run, size_t lane, const SplineSheet& sheet, const Experiment& e, double t_s, double steps) {
  if (e.guide->let_go.is_free(t_s - e.guide->start_s)) return;
  const Eigen::Matrix3Xd x = run.position(lane), v = run.velocity(lane);
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, x.cols());
  add_nudging(*e.guide, e.material.density * sheet.swatch.width_m * sheet.swatch.height_m, t_s, x.data(), v.data(),
              force.data());
  for (Eigen::Index i = 0; i < force.cols(); ++i)
    if (!force.col(i).isZero(0)) run.push(lane, static_cast<int>(i), steps * force.col(i));
}

// Runs a group from its starts in `out` and fills in the samples.
template <class T>
void run_group(const SplineSheet& sheet, const std::vector<const Experiment*>& lanes, double step_s,
               const Stages& stages, const std::vector<Trajectory*>& out) {
  LaneRun<T> run(sheet, lanes);
  run.plan(step_s, stages);
  for (size_t i = 0; i < lanes.size(); ++i) {
    run.set_position(i, out[i]->start);
    out[i]->samples.clear();
    out[i]->finite = true;
  }
  const std::vector<double>& wanted = lanes[0]->sample_s;
  const double begin = lanes[0]->start_s, end = wanted.empty() ? begin : wanted.back();
  const int steps = std::max(0, static_cast<int>(std::ceil((end - begin) / step_s - 1e-9)));
  const int pull_every = std::max(1, static_cast<int>(kNudgeEvery_s / step_s));
  size_t next = 0;
  const auto keep_until = [&](double from_s, double to_s, const std::vector<Eigen::Matrix3Xd>& before) {
    for (; next < wanted.size() && wanted[next] <= to_s + 1e-12; ++next)
      for (size_t i = 0; i < lanes.size(); ++i) {
        const Eigen::Matrix3Xd now = run.position(i);
        const double share = to_s > from_s ? std::clamp((wanted[next] - from_s) / (to_s - from_s), 0.0, 1.0) : 1.0;
        out[i]->samples.push_back(before.empty() ? now : before[i] + share * (now - before[i]));
      }
  };
  keep_until(begin, begin, {});
  if (run.has_memory()) run.set_forces(cloth::kernel::kBroughtFromFlat);
  std::vector<Eigen::Matrix<double, 3, 2>> corners, ahead;
  for (const Experiment* e : lanes) corners.push_back(e->path.at(begin));
  for (int step = 0; step < steps; ++step) {
    const double from = begin + step * step_s, to = begin + (step + 1) * step_s;
    run.set_forces(step_s);
    ahead.clear();
    for (size_t i = 0; i < lanes.size(); ++i) {
      ahead.push_back(lanes[i]->path.at(to));
      run.hold(i, lanes[i]->path, corners[i], ahead[i]);
      if (lanes[i]->guide && step % pull_every == 0) pull(run, i, sheet, *lanes[i], from, pull_every);
    }
    std::swap(corners, ahead);
    const bool sampled = next < wanted.size() && wanted[next] <= to + 1e-12;
    std::vector<Eigen::Matrix3Xd> before;
    for (size_t i = 0; sampled && i < lanes.size(); ++i) before.push_back(run.position(i));
    run.advance();
    if (sampled) keep_until(from, to, before);
  }
  keep_until(end, std::numeric_limits<double>::infinity(), {});
  for (size_t i = 0; i < lanes.size(); ++i) out[i]->finite = run.position(i).allFinite() && run.velocity(i).allFinite();
}

void run_group(const SplineSheet& sheet, const std::vector<const Experiment*>& lanes, Precision precision,
               double step_s, const Stages& stages, const std::vector<Trajectory*>& out) {
  if (precision == Precision::single) run_group<float>(sheet, lanes, step_s, stages, out);
  else run_group<double>(sheet, lanes, step_s, stages, out);
}

// Those that take their steps alike, in groups that the kernels hold.
std::vector<std::vector<size_t>> grouped(const std::vector<Stages>& stages, size_t most) {
  std::map<std::pair<int, double>, std::vector<size_t>> alike;
  for (size_t i = 0; i < stages.size(); ++i) alike[{stages[i].count, stages[i].gain[0]}].push_back(i);
  std::vector<std::vector<size_t>> groups;
  for (const auto& [key, members] : alike)
    for (size_t first = 0; first < members.size(); first += most)
      groups.emplace_back(members.begin() + static_cast<std::ptrdiff_t>(first),
                          members.begin() + static_cast<std::ptrdiff_t>(std::min(first + most, members.size())));
  return groups;
}

// Of the planned step: strains beside the grips may exceed what the plan guesses.
constexpr double kShare = 0.8;

double shortest_step_s(const std::vector<Spectrum>& spectra) {
  double step = std::numeric_limits<double>::infinity();
  for (const Spectrum& s : spectra) step = std::min(step, kShare * plan_step(s).step_s);
  return step;
}

std::vector<Spectrum> spectra_of(const SplineSheet& sheet, const std::vector<Experiment>& lanes) {
  std::vector<Spectrum> spectra(lanes.size());
  tbb::parallel_for(size_t{0}, lanes.size(), [&](size_t i) { spectra[i] = spectrum_of(sheet, lanes[i].material); });
  return spectra;
}

}  // namespace

double common_step_s(const SplineSheet& sheet, const std::vector<Experiment>& lanes) {
  return shortest_step_s(spectra_of(sheet, lanes));
}

std::vector<Trajectory> simulate(const SplineSheet& sheet, const std::vector<Experiment>& lanes,
                                 const Options& options) {
  check_lanes(lanes);
  std::vector<Trajectory> out(lanes.size());
  tbb::parallel_for(size_t{0}, lanes.size(), [&](size_t i) {
    out[i].start = lanes[i].start_shape;
    if (!lanes[i].starts_at_rest) return;
    Settled rest = settle(sheet, lanes[i], lanes[i].start_shape, options.rest_change_m);
    out[i].at_rest = rest.at_rest;
    out[i].start = std::move(rest.position);
  });
  const std::vector<Spectrum> spectra = spectra_of(sheet, lanes);
  const double step_s = options.step_s > 0 ? options.step_s : shortest_step_s(spectra);
  std::vector<Stages> stages;
  for (const Spectrum& s : spectra) stages.push_back(stages_for(s, step_s));
  const bool single = options.precision == Precision::single;
  const auto groups =
      grouped(stages, static_cast<size_t>(single ? kernel::most_lanes<float>() : kernel::most_lanes<double>()));
  const auto run = [&](const std::vector<size_t>& members, double h, const Stages& plan) {
    std::vector<const Experiment*> group;
    std::vector<Trajectory*> to;
    for (const size_t i : members) {
      group.push_back(&lanes[i]);
      to.push_back(&out[i]);
    }
    run_group(sheet, group, options.precision, h, plan, to);
  };
  tbb::parallel_for(size_t{0}, groups.size(), [&](size_t g) { run(groups[g], step_s, stages[groups[g][0]]); });
  for (size_t i = 0; i < lanes.size(); ++i)
    for (double h = step_s / 2; !out[i].finite && h > step_s / 10; h /= 2) run({i}, h, stages_for(spectra[i], h));
  return out;
}

Eigen::Matrix3Xd hung_shape(const SplineSheet& sheet, const Experiment& e, double side) {
  // The nodes of a mesh are all that the triangles' shape asks of it.
  Sheet nodes;
  nodes.mesh.rest_uv = greville_points(sheet);
  nodes.mesh.width_m = sheet.swatch.width_m;
  nodes.mesh.height_m = sheet.swatch.height_m;
  nodes.data.vertex_count = sheet.count();
  const Eigen::Matrix3Xd shape = cloth::hung_shape(nodes, e, side);
  Eigen::Index next = 0;
  return control_points_through(sheet, [&](const Eigen::Vector2d&) -> Eigen::Vector3d { return shape.col(next++); });
}

}  // namespace selvedge::cloth::spline
