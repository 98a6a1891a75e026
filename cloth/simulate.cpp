#include "cloth/simulate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include <tbb/parallel_for.h>

#include "cloth/held_motion.h"
#include "cloth/implicit_euler.h"
#include "cloth/runge_kutta.h"
#include "cloth/settle.h"
#include "cloth/start_shape.h"
#include "cloth/step_plan.h"

namespace selvedge::cloth {

namespace {

void append(std::vector<double>& to, const Eigen::Matrix3Xd& columns) {
  to.insert(to.end(), columns.data(), columns.data() + columns.size());
}

Eigen::Matrix3Xd columns_at(const std::vector<double>& from, size_t offset, Eigen::Index count) {
  return Eigen::Map<const Eigen::Matrix3Xd>(from.data() + offset, 3, count);
}

// What all lanes of a group share, and what each brings.
kernel::RunInput input_of(const Sheet& sheet, const std::vector<const Experiment*>& lanes,
                          const std::vector<const Eigen::Matrix3Xd*>& start) {
  kernel::RunInput in;
  in.sheet = &sheet.data;
  in.lanes = static_cast<int>(lanes.size());
  in.held = held_vertices(sheet, lanes[0]->path.hold);
  for (int a = 0; a < 3; ++a) in.clamp_direction[a] = lanes[0]->path.clamp_direction(a);
  for (size_t i = 0; i < lanes.size(); ++i) {
    in.materials.push_back(lanes[i]->material);
    in.surroundings.push_back(surroundings_of(*lanes[i]));
    append(in.start_position, *start[i]);
  }
  return in;
}

std::vector<size_t> every_one_of(const std::vector<Experiment>& lanes) {
  std::vector<size_t> all(lanes.size());
  std::iota(all.begin(), all.end(), size_t{0});
  return all;
}

// Those of `which` that may share a SIMD group without changing each other's bits, in groups of at most most_lanes().
std::vector<std::vector<size_t>> grouped(const std::vector<Experiment>& lanes, const std::vector<size_t>& which,
                                         const std::vector<kernel::DampingStages>& stages) {
  std::map<std::tuple<bool, int, double>, std::vector<size_t>> alike;
  for (const size_t i : which)
    alike[{bends_uniformly(lanes[i].material), stages[i].count, stages[i].gain[0]}].push_back(i);
  std::vector<std::vector<size_t>> groups;
  const auto most = static_cast<size_t>(kernel::most_lanes());
  for (const auto& [key, members] : alike)
    for (size_t first = 0; first < members.size(); first += most)
      groups.emplace_back(members.begin() + static_cast<std::ptrdiff_t>(first),
                          members.begin() + static_cast<std::ptrdiff_t>(std::min(first + most, members.size())));
  return groups;
}

// Relaxation is free to choose masses and damping: masses such that kRelaxStep_s is each lane's longest step
// (and a lane's way does not depend on its companions), damping a tenth of critical for the fastest mode so
// that ripples do not pass for peaks of the sheet's own motion.
constexpr double kRelaxStep_s = 1e-4;

Experiment made_to_relax(const Experiment& lane, const Spectrum& s) {
  const double omega = std::sqrt(std::max(s.membrane_omega2, s.bend_omega2)), ratio = 0.1;
  const double step = 0.85 * 2 / omega * (std::sqrt(1 + ratio * ratio) - ratio);
  const double speed_up = step / kRelaxStep_s, mass = 1 / (speed_up * speed_up);
  const double damping_s = 2 * ratio / (omega * speed_up);  // per stiffness
  Experiment e = lane;
  Material& m = e.material;
  m.density *= mass;
  m.hem_density *= mass;
  m.local_mass_kg *= mass;
  m.added_mass = 0;
  m.stretch_damping = damping_s * m.stretch;
  m.shear_damping = damping_s * m.shear;
  m.bend_damping = damping_s * m.bend;
  e.gravity_m_s2 /= mass;
  return e;
}

// From where `out` has each member.
void relax_group(const Sheet& sheet, const std::vector<Experiment>& lanes, const std::vector<Spectrum>& spectra,
                 const std::vector<size_t>& members, const Options& options, std::vector<Rest>& out) {
  std::vector<Experiment> free;
  std::vector<const Experiment*> group;
  std::vector<const Eigen::Matrix3Xd*> start;
  for (const size_t i : members) free.push_back(made_to_relax(lanes[i], spectra[i]));
  for (const Experiment& e : free) group.push_back(&e);
  for (const size_t i : members) start.push_back(&out[i].position);
  kernel::RunInput in = input_of(sheet, group, start);
  for (const Experiment& e : free) {
    const Eigen::Matrix<double, 3, 2> corners = e.path.at(e.start_s);
    in.held_corners.insert(in.held_corners.end(), corners.data(), corners.data() + 6);
  }
  kernel::RelaxOptions relax_options;
  relax_options.step_s = kRelaxStep_s;
  relax_options.max_steps = static_cast<int>(options.longest_rest_s / kRelaxStep_s);
  relax_options.speed_m_s = options.rest_speed_m_s;
  relax_options.change_m = options.rest_change_m;
  const kernel::RelaxOutput result = kernel::relax(in, relax_options);
  const auto n = static_cast<Eigen::Index>(sheet.data.vertex_count);
  for (size_t i = 0; i < members.size(); ++i)
    out[members[i]] = {columns_at(result.position, i * static_cast<size_t>(n * 3), n), result.at_rest[i]};
}

void run_group(const Sheet& sheet, const std::vector<Experiment>& lanes, const std::vector<size_t>& members,
               double step_s, const kernel::DampingStages& stages, std::vector<Trajectory>& out) {
  std::vector<const Experiment*> group;
  std::vector<const Eigen::Matrix3Xd*> start;
  for (const size_t i : members) {
    group.push_back(&lanes[i]);
    start.push_back(&out[i].start);
  }
  kernel::RunInput in = input_of(sheet, group, start);
  in.step_s = step_s;
  in.stages = stages;
  const double start_s = group[0]->start_s, end_s = group[0]->sample_s.empty() ? start_s : group[0]->sample_s.back();
  in.steps = std::max(0, static_cast<int>(std::ceil((end_s - start_s) / step_s - 1e-9)));
  for (const double t : group[0]->sample_s) in.sample_s.push_back(t - start_s);
  in.start_s = start_s;
  for (const Experiment* e : group)
    if (kernel::StepFilter filter = step_filter_of(*e)) in.step_filters.push_back(std::move(filter));
  if (group[0]->guide && !group[0]->make_step_filter)
    in.filter_every = std::max(1, static_cast<int>(kNudgeEvery_s / step_s));
  in.held_corners.reserve(members.size() * static_cast<size_t>(in.steps + 1) * 6);
  for (const Experiment* e : group)
    for (int k = 0; k <= in.steps; ++k) {
      const Eigen::Matrix<double, 3, 2> corners = e->path.at(start_s + k * step_s);
      in.held_corners.insert(in.held_corners.end(), corners.data(), corners.data() + 6);
    }
  const kernel::RunOutput result = kernel::run(in);
  const auto n = static_cast<Eigen::Index>(sheet.data.vertex_count);
  const size_t samples = in.sample_s.size();
  for (size_t i = 0; i < members.size(); ++i) {
    Trajectory& trajectory = out[members[i]];
    trajectory.finite = result.finite[i];
    trajectory.samples.clear();
    for (size_t k = 0; k < samples; ++k)
      trajectory.samples.push_back(columns_at(result.samples, (i * samples + k) * static_cast<size_t>(3 * n), n));
  }
}

std::vector<Spectrum> spectra_of(const Sheet& sheet, const std::vector<Experiment>& lanes) {
  std::vector<Spectrum> spectra;
  for (const Experiment& lane : lanes) spectra.push_back(spectrum_of(sheet, lane.material));
  return spectra;
}

double shortest_step_s(const std::vector<Spectrum>& spectra) {
  double step = std::numeric_limits<double>::infinity();
  for (const Spectrum& s : spectra) step = std::min(step, plan_step(s).step_s);
  return step;
}

std::vector<Rest> relax_all(const Sheet& sheet, const std::vector<Experiment>& lanes,
                            const std::vector<Spectrum>& spectra, const Options& options) {
  std::vector<Rest> rests(lanes.size());
  for (size_t i = 0; i < lanes.size(); ++i) rests[i].position = lanes[i].start_shape;
  std::vector<size_t> open = every_one_of(lanes);  // not yet at rest
  const auto settle_open = [&] {
    tbb::parallel_for(size_t{0}, open.size(), [&](size_t k) {
      Rest& rest = rests[open[k]];
      Settled settled = settle(sheet, lanes[open[k]], rest.position, options.rest_change_m);
      rest.at_rest = settled.at_rest;
      if (settled.at_rest) rest.position = std::move(settled.position);
    });
    std::erase_if(open, [&](size_t i) { return rests[i].at_rest; });
  };
  const auto relax_open = [&](const Options& how) {
    const auto groups = grouped(lanes, open, std::vector<kernel::DampingStages>(lanes.size()));
    tbb::parallel_for(size_t{0}, groups.size(),
                      [&](size_t g) { relax_group(sheet, lanes, spectra, groups[g], how, rests); });
  };
  // Starts that are near settle at once. Others are brought nearer by motion first, and by motion alone where that
  // does not do either.
  settle_open();
  Options nearer = options;
  nearer.rest_change_m = std::max(options.rest_change_m, 1e-3);
  nearer.rest_speed_m_s = std::max(options.rest_speed_m_s, 0.05);
  relax_open(nearer);
  settle_open();
  relax_open(options);
  return rests;
}

// Leapfrog for all lanes from their starts in `out`.
void run_leapfrog(const Sheet& sheet, const std::vector<Experiment>& lanes, const std::vector<Spectrum>& spectra,
                  double step_s, std::vector<Trajectory>& out) {
  std::vector<kernel::DampingStages> stages;
  for (const Spectrum& s : spectra) stages.push_back(stages_for(s, step_s));
  const auto groups = grouped(lanes, every_one_of(lanes), stages);
  tbb::parallel_for(size_t{0}, groups.size(),
                    [&](size_t g) { run_group(sheet, lanes, groups[g], step_s, stages[groups[g][0]], out); });
  for (size_t i = 0; i < lanes.size(); ++i)
    for (double h = step_s / 2; !out[i].finite && h > step_s / 10; h /= 2)
      run_group(sheet, lanes, {i}, h, stages_for(spectra[i], h), out);
}

void check_lanes(const std::vector<Experiment>& lanes) {
  for (const Experiment& lane : lanes) {
    if (!lane.smooth_forces.empty()) throw std::invalid_argument("simulate: smooth forces are for splines");
    if (lane.start_s != lanes[0].start_s || lane.sample_s != lanes[0].sample_s ||
        lane.path.hold != lanes[0].path.hold || !lane.make_step_filter != !lanes[0].make_step_filter ||
        !lane.guide != !lanes[0].guide)
      throw std::invalid_argument(
          "simulate: lanes must share start_s, sample_s, the way of holding, contact or none, and a guide or none");
  }
}

}  // namespace

kernel::StepFilter step_filter_of(const Experiment& e) {
  kernel::StepFilter contact = e.make_step_filter ? e.make_step_filter() : kernel::StepFilter{};
  return e.guide ? guided(e.guide, std::move(contact)) : contact;
}

double stable_step_s(const Sheet& sheet, const Material& material) {
  return plan_step(spectrum_of(sheet, material)).step_s;
}

double common_step_s(const Sheet& sheet, const std::vector<Experiment>& lanes) {
  return shortest_step_s(spectra_of(sheet, lanes));
}

std::vector<Rest> relax(const Sheet& sheet, const std::vector<Experiment>& lanes, const Options& options) {
  check_lanes(lanes);
  return relax_all(sheet, lanes, spectra_of(sheet, lanes), options);
}

std::vector<Trajectory> simulate(const Sheet& sheet, const std::vector<Experiment>& lanes, const Options& options) {
  check_lanes(lanes);
  const std::vector<Spectrum> spectra = spectra_of(sheet, lanes);
  std::vector<Trajectory> out(lanes.size());
  std::vector<Rest> rests;
  if (!lanes.empty() && lanes[0].starts_at_rest) rests = relax_all(sheet, lanes, spectra, options);
  for (size_t i = 0; i < lanes.size(); ++i) {
    out[i].start = rests.empty() ? lanes[i].start_shape : rests[i].position;
    out[i].at_rest = rests.empty() || rests[i].at_rest;
  }
  if (options.integrator == Options::Integrator::runge_kutta_45)
    for (size_t i = 0; i < lanes.size(); ++i) run_runge_kutta(sheet, lanes[i], options.tolerance_m, out[i]);
  else if (options.integrator == Options::Integrator::implicit_euler)
    for (size_t i = 0; i < lanes.size(); ++i)
      run_implicit_euler(sheet, lanes[i], options.step_s > 0 ? options.step_s : kImplicitStep_s, out[i]);
  else run_leapfrog(sheet, lanes, spectra, options.step_s > 0 ? options.step_s : shortest_step_s(spectra), out);
  return out;
}

std::vector<kernel::HeldVertex> held_vertices(const Sheet& sheet, Hold hold) {
  const auto& uv = sheet.mesh.rest_uv;
  const double width = sheet.mesh.width_m;
  if (hold == Hold::nothing) return {};
  if (hold == Hold::corners)
    return {{geometry::nearest_vertex(sheet.mesh, {0, 0}), 0, 0},
            {geometry::nearest_vertex(sheet.mesh, {width, 0}), 1, 0}};
  std::vector<kernel::HeldVertex> held;
  if (hold == Hold::side_edges) {
    for (size_t i = 0; i < uv.size(); ++i)
      if (uv[i].x() < 1e-9 || uv[i].x() > width - 1e-9)
        held.push_back({static_cast<int>(i), uv[i].x() / width, uv[i].y()});
    return held;
  }
  // A clamp also fixes the row below the edge: the lowest v that is not the edge's own.
  const bool clamped = hold == Hold::top_edge_clamped;
  double row = 0;
  if (clamped) {
    row = sheet.mesh.height_m;
    for (const auto& p : uv)
      if (p.y() > 1e-9) row = std::min(row, p.y());
  }
  for (size_t i = 0; i < uv.size(); ++i)
    if (uv[i].y() <= row + 1e-9)
      held.push_back({static_cast<int>(i), uv[i].x() / width, uv[i].y(),
                      !clamped           ? 1
                      : uv[i].y() < 1e-9 ? 0
                                         : 2.0 / 3});
  return held;
}

Eigen::Matrix3Xd hung_shape(const Sheet& sheet, const Experiment& e, double side) {
  const ShapeOf shape = hung(e.path, e.start_s, e.gravity_m_s2, sheet.mesh.width_m, side);
  Eigen::Matrix3Xd out(3, sheet.data.vertex_count);
  for (Eigen::Index i = 0; i < out.cols(); ++i) out.col(i) = shape(sheet.mesh.rest_uv[static_cast<size_t>(i)]);
  return out;
}

}  // namespace selvedge::cloth
