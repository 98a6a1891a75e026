// The loops behind run.h, over the number type R.
#pragma once

#include <algorithm>
#include <cmath>

#include "cloth/kernel/acceleration.h"
#include "cloth/kernel/run.h"

namespace selvedge::cloth::kernel {

template <class R>
Vec3<R> load(const double* lane_major, size_t stride, int lanes, size_t offset) {
  Vec3<R> out{};
  for (int i = 0; i < lanes_of<R>; ++i) {
    const double* from = lane_major + static_cast<size_t>(std::min(i, lanes - 1)) * stride + offset;
    set_lane(out.x, i, from[0]);
    set_lane(out.y, i, from[1]);
    set_lane(out.z, i, from[2]);
  }
  return out;
}

template <class R>
void store(const Vec3<R>& value, int i, double* to) {
  to[0] = lane(value.x, i);
  to[1] = lane(value.y, i);
  to[2] = lane(value.z, i);
}

template <class R>
void load_state(const RunInput& in, Workspace<R>& w) {
  const size_t n = w.x.size(), stride = 3 * n;
  for (size_t v = 0; v < n; ++v) {
    w.x[v] = load<R>(in.start_position.data(), stride, in.lanes, 3 * v);
    w.v[v] = in.start_velocity.empty() ? Vec3<R>{} : load<R>(in.start_velocity.data(), stride, in.lanes, 3 * v);
  }
}

// Where a held vertex is at a step.
template <class R>
Vec3<R> held_position(const RunInput& in, const HeldVertex& h, int step) {
  const size_t per_lane = static_cast<size_t>(in.steps + 1) * 6;
  const Vec3<R> left = load<R>(in.held_corners.data(), per_lane, in.lanes, static_cast<size_t>(step) * 6);
  const Vec3<R> right = load<R>(in.held_corners.data(), per_lane, in.lanes, static_cast<size_t>(step) * 6 + 3);
  const Vec3<R> below{broadcast<R>(h.below_m * in.clamp_direction[0]), broadcast<R>(h.below_m * in.clamp_direction[1]),
                      broadcast<R>(h.below_m * in.clamp_direction[2])};
  return left + scaled(h.along, right - left) + below;
}

template <class R>
void leap(const RunInput& in, const LaneMaterial<R>& p, Workspace<R>& w, int step) {
  const double h = in.step_s;
  accelerations(*in.sheet, p, w, h);
  for (size_t v = 0; v < w.x.size(); ++v) {
    w.v[v] += scaled(h, w.force[v]);
    w.x[v] += scaled(h, w.v[v]);
  }
  for (const HeldVertex& held : in.held) {
    const auto v = static_cast<size_t>(held.vertex);
    const Vec3<R> before = held_position<R>(in, held, step);
    w.x[v] = held_position<R>(in, held, step + 1);
    w.v[v] = scaled(1 / h, w.x[v] - before);
  }
}

// Positions between two steps, linear in time.
template <class R>
void keep_sample(const Workspace<R>& w, const std::vector<Vec3<R>>& before, double share, size_t sample,
                 size_t samples, int lanes, std::vector<double>& out) {
  const size_t n = w.x.size();
  for (size_t v = 0; v < n; ++v) {
    const Vec3<R> value = before[v] + scaled(share, w.x[v] - before[v]);
    for (int i = 0; i < lanes; ++i) store(value, i, &out[((static_cast<size_t>(i) * samples + sample) * n + v) * 3]);
  }
}

template <class R>
RunOutput run_lanes(const RunInput& in) {
  const auto p = unpack<R>(*in.sheet, in.materials.data(), in.surroundings.data(), in.lanes);
  Workspace<R> w(*in.sheet);
  load_state(in, w);
  const size_t n = w.x.size(), samples = in.sample_s.size();
  RunOutput out;
  out.samples.resize(static_cast<size_t>(in.lanes) * samples * n * 3);
  std::vector<Vec3<R>> before = w.x;
  size_t next = 0;
  while (next < samples && in.sample_s[next] <= 0) keep_sample(w, w.x, 0, next++, samples, in.lanes, out.samples);

  for (int step = 0; step < in.steps; ++step) {
    const double start = step * in.step_s, end = start + in.step_s;
    const bool sampled = next < samples && in.sample_s[next] <= end;
    if (sampled) before = w.x;
    leap(in, p, w, step);
    while (next < samples && in.sample_s[next] <= end)
      keep_sample(w, before, (in.sample_s[next] - start) / in.step_s, next, samples, in.lanes, out.samples), ++next;
  }
  while (next < samples) keep_sample(w, w.x, 0, next++, samples, in.lanes, out.samples);

  out.final_position.resize(static_cast<size_t>(in.lanes) * n * 3);
  out.final_velocity.resize(out.final_position.size());
  out.finite.assign(static_cast<size_t>(in.lanes), true);
  for (int i = 0; i < in.lanes; ++i)
    for (size_t v = 0; v < n; ++v) {
      const size_t at = (static_cast<size_t>(i) * n + v) * 3;
      store(w.x[v], i, &out.final_position[at]);
      store(w.v[v], i, &out.final_velocity[at]);
      if (!std::isfinite(out.final_position[at])) out.finite[static_cast<size_t>(i)] = false;
    }
  return out;
}

template <class R>
struct Motion {
  R energy{};         // J
  R fastest{};        // m²/s², squared speed
};

template <class R>
Motion<R> motion_of_all(const LaneMaterial<R>& p, const Workspace<R>& w) {
  Motion<R> m;
  for (size_t v = 0; v < w.v.size(); ++v) {
    const R squared = dot(w.v[v], w.v[v]);
    m.energy += 0.5 * p.mass[v] * squared;
    m.fastest = larger(m.fastest, squared);
  }
  return m;
}

// What relax keeps of each lane.
struct LaneRest {
  double energy = 0;             // at the look before
  bool done = false;
  std::vector<double> at_peak;   // position at the last peak
};

template <class R>
RelaxOutput relax_lanes(const RunInput& in, const RelaxOptions& options) {
  auto p = unpack<R>(*in.sheet, in.materials.data(), in.surroundings.data(), in.lanes);
  Workspace<R> w(*in.sheet);
  RunInput still = in;
  still.steps = 0;  // held_corners hold one entry a lane
  still.step_s = options.step_s;
  load_state(still, w);
  const size_t n = w.x.size();
  for (const HeldVertex& held : in.held) w.x[static_cast<size_t>(held.vertex)] = held_position<R>(still, held, 0);

  RelaxOutput out;
  out.position.resize(static_cast<size_t>(in.lanes) * n * 3);
  out.at_rest.assign(static_cast<size_t>(in.lanes), false);
  out.steps.assign(static_cast<size_t>(in.lanes), options.max_steps);
  std::vector<LaneRest> rest(static_cast<size_t>(in.lanes));
  const auto keep = [&](int i, std::vector<double>& to, size_t offset) {
    for (size_t v = 0; v < n; ++v) store(w.x[v], i, &to[offset + 3 * v]);
  };
  const int look_every = std::max(1, static_cast<int>(std::lround(options.check_s / options.step_s)));
  int open = in.lanes;
  for (int step = 0; step < options.max_steps && open > 0; ++step) {
    accelerations(*in.sheet, p, w, 0);
    for (size_t v = 0; v < n; ++v) w.v[v] += scaled(options.step_s, w.force[v]);
    for (const HeldVertex& held : in.held) w.v[static_cast<size_t>(held.vertex)] = Vec3<R>{};
    for (size_t v = 0; v < n; ++v) w.x[v] += scaled(options.step_s, w.v[v]);
    if ((step + 1) % look_every != 0) continue;

    const Motion<R> now = motion_of_all(p, w);
    for (int i = 0; i < in.lanes; ++i) {
      LaneRest& r = rest[static_cast<size_t>(i)];
      const double energy = lane(now.energy, i);
      if (r.done || energy > r.energy) {
        r.energy = energy;
        continue;
      }
      // A peak has passed: stop this lane.
      double moved = 1;
      std::vector<double> here(3 * n);
      keep(i, here, 0);
      if (!r.at_peak.empty()) {
        moved = 0;
        for (size_t k = 0; k < here.size(); ++k) moved = std::max(moved, std::abs(here[k] - r.at_peak[k]));
      }
      r.at_peak = std::move(here);
      r.energy = 0;
      for (size_t v = 0; v < n; ++v) {
        set_lane(w.v[v].x, i, 0.0);
        set_lane(w.v[v].y, i, 0.0);
        set_lane(w.v[v].z, i, 0.0);
      }
      if (moved < options.change_m && std::sqrt(lane(now.fastest, i)) < options.speed_m_s) {
        r.done = true;
        --open;
        out.at_rest[static_cast<size_t>(i)] = true;
        out.steps[static_cast<size_t>(i)] = step + 1;
        keep(i, out.position, static_cast<size_t>(i) * 3 * n);
      }
    }
  }
  for (int i = 0; i < in.lanes; ++i)
    if (!rest[static_cast<size_t>(i)].done) keep(i, out.position, static_cast<size_t>(i) * 3 * n);
  return out;
}

}  // namespace selvedge::cloth::kernel
