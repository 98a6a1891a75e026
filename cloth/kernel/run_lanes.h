// The loops behind run.h, over the vertex vector V (pack.h).
#pragma once

#include <algorithm>
#include <cmath>

#include "cloth/kernel/acceleration.h"
#include "cloth/kernel/run.h"

namespace selvedge::cloth::kernel {

template <class V>
V load(const double* lane_major, size_t stride, int lanes, size_t offset) {
  V out{};
  for (int i = 0; i < Kind<V>::runs; ++i) {
    const double* from = lane_major + static_cast<size_t>(std::min(i, lanes - 1)) * stride + offset;
    set_run(out, i, from[0], from[1], from[2]);
  }
  return out;
}

template <class V>
void load_state(const RunInput& in, Workspace<V>& w) {
  const size_t n = w.x.size(), stride = 3 * n;
  for (size_t v = 0; v < n; ++v) {
    w.x[v] = load<V>(in.start_position.data(), stride, in.lanes, 3 * v);
    w.v[v] = in.start_velocity.empty() ? V{} : load<V>(in.start_velocity.data(), stride, in.lanes, 3 * v);
  }
}

// Where a held vertex is at a step.
template <class V>
V held_position(const RunInput& in, const HeldVertex& h, int step) {
  const size_t per_lane = static_cast<size_t>(in.steps + 1) * 6;
  const V left = load<V>(in.held_corners.data(), per_lane, in.lanes, static_cast<size_t>(step) * 6);
  const V right = load<V>(in.held_corners.data(), per_lane, in.lanes, static_cast<size_t>(step) * 6 + 3);
  double below[3];
  for (int a = 0; a < 3; ++a) below[a] = h.below_m * in.clamp_direction[a];
  return left + scaled(h.along, right - left) + load<V>(below, 0, 1, 0);
}

template <class V>
void zero_held(const RunInput& in, std::vector<V>& values) {
  for (const HeldVertex& held : in.held) values[static_cast<size_t>(held.vertex)] = V{};
}

// The changes of velocity of one step, left in change[0].
template <class V>
void staged_change(const RunInput& in, const Materials<V>& m, Workspace<V>& w, std::vector<V> (&change)[3]) {
  const size_t n = w.x.size();
  const DampingStages& s = in.stages;
  auto &now = change[0], &before = change[1], &next = change[2];
  for (size_t i = 0; i < n; ++i) now[i] = scaled(s.gain[0] * in.step_s, w.acceleration[i]);
  for (int j = 1; j < s.count; ++j) {
    damping_accelerations(*in.sheet, m, w, now, next);
    zero_held(in, next);
    const double mu = s.mu[j], nu = j > 1 ? s.nu[j] : 0, gain = s.gain[j] * in.step_s;
    for (size_t i = 0; i < n; ++i)
      next[i] = add_scaled(mu, now[i], add_scaled(nu, before[i], scaled(gain, w.acceleration[i] + next[i])));
    std::swap(before, now);
    std::swap(now, next);
  }
}

template <class V>
void leap(const RunInput& in, const Materials<V>& m, Workspace<V>& w, std::vector<V> (&change)[3], int step) {
  const double h = in.step_s;
  const size_t n = w.x.size();
  accelerations(*in.sheet, m, w, h);
  if (in.stages.count == 1) {
    for (size_t i = 0; i < n; ++i) {
      w.v[i] = add_scaled(h, w.acceleration[i], w.v[i]);
      w.x[i] = add_scaled(h, w.v[i], w.x[i]);
    }
  } else {
    zero_held(in, w.acceleration);
    staged_change(in, m, w, change);
    for (size_t i = 0; i < n; ++i) {
      w.v[i] += change[0][i];
      w.x[i] = add_scaled(h, w.v[i], w.x[i]);
    }
  }
  for (const HeldVertex& held : in.held) {
    const auto i = static_cast<size_t>(held.vertex);
    const V before = held_position<V>(in, held, step);
    w.x[i] = held_position<V>(in, held, step + 1);
    w.v[i] = scaled(1 / h, w.x[i] - before);
  }
}

// Hands a step to each lane's filter and takes over what it changed.
template <class V>
class Filtering {
 public:
  Filtering(const RunInput& in, const Materials<V>& m) : in_(in), n_(static_cast<size_t>(in.sheet->vertex_count)) {
    if (in.step_filters.empty()) return;
    from_.resize(3 * n_);
    to_.resize(3 * n_);
    velocity_.resize(3 * n_);
    for (int i = 0; i < in.lanes; ++i) {
      std::vector<double>& inverse_mass = inverse_mass_.emplace_back(n_);
      for (size_t v = 0; v < n_; ++v) inverse_mass[v] = lane(m.vertex.inverse_mass[v], i);
      for (const HeldVertex& held : in.held) inverse_mass[static_cast<size_t>(held.vertex)] = 0;
    }
  }

  bool wants(int step) const { return !in_.step_filters.empty() && step % in_.filter_every == 0; }

  void apply(Workspace<V>& w, const std::vector<V>& before, double start_s) {
    for (int i = 0; i < in_.lanes; ++i) {
      for (size_t v = 0; v < n_; ++v) {
        store_run(before[v], i, &from_[3 * v]);
        store_run(w.x[v], i, &to_[3 * v]);
        store_run(w.v[v], i, &velocity_[3 * v]);
      }
      const auto at = static_cast<size_t>(i);
      in_.step_filters[at]({start_s, in_.step_s, in_.filter_every * in_.step_s, n_, from_.data(), to_.data(),
                            velocity_.data(), inverse_mass_[at].data()});
      for (size_t v = 0; v < n_; ++v) {
        set_run(w.x[v], i, to_[3 * v], to_[3 * v + 1], to_[3 * v + 2]);
        set_run(w.v[v], i, velocity_[3 * v], velocity_[3 * v + 1], velocity_[3 * v + 2]);
      }
    }
  }

 private:
  const RunInput& in_;
  size_t n_;
  std::vector<double> from_, to_, velocity_;
  std::vector<std::vector<double>> inverse_mass_;
};

// Positions between two steps, linear in time.
template <class V>
void keep_sample(const Workspace<V>& w, const std::vector<V>& before, double share, size_t sample, size_t samples,
                 int lanes, std::vector<double>& out) {
  const size_t n = w.x.size();
  for (size_t v = 0; v < n; ++v) {
    const V value = before[v] + scaled(share, w.x[v] - before[v]);
    for (int i = 0; i < lanes; ++i)
      store_run(value, i, &out[((static_cast<size_t>(i) * samples + sample) * n + v) * 3]);
  }
}

template <class V>
RunOutput run_lanes(const RunInput& in) {
  const auto m = unpack_materials<V>(*in.sheet, in.materials.data(), in.surroundings.data(), in.lanes, in.held);
  Workspace<V> w(*in.sheet);
  if (in.stages.count > 1) w.keep_frames();
  load_state(in, w);
  const size_t n = w.x.size(), samples = in.sample_s.size();
  if (m.vertex.uses_bend_friction || m.triangle.uses_membrane_memory) accelerations(*in.sheet, m, w, kBroughtFromFlat);
  RunOutput out;
  out.samples.resize(static_cast<size_t>(in.lanes) * samples * n * 3);
  std::vector<V> before = w.x, change[3] = {w.x, w.x, w.x};
  Filtering<V> filtering(in, m);
  size_t next = 0;
  while (next < samples && in.sample_s[next] <= 0) keep_sample(w, w.x, 0, next++, samples, in.lanes, out.samples);

  for (int step = 0; step < in.steps; ++step) {
    const double start = step * in.step_s, end = start + in.step_s;
    const bool sampled = next < samples && in.sample_s[next] <= end;
    const bool filtered = filtering.wants(step);
    if (sampled || filtered) before = w.x;
    leap(in, m, w, change, step);
    if (filtered) filtering.apply(w, before, in.start_s + start);
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
      store_run(w.x[v], i, &out.final_position[at]);
      store_run(w.v[v], i, &out.final_velocity[at]);
      if (!std::isfinite(out.final_position[at])) out.finite[static_cast<size_t>(i)] = false;
    }
  return out;
}

template <class R>
struct Motion {
  R energy{};   // J
  R fastest{};  // m²/s², squared speed
};

template <class V>
Motion<ScalarOf<V>> motion_of_all(const LaneMaterial<ScalarOf<V>>& p, const Workspace<V>& w) {
  using R = ScalarOf<V>;
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
  double energy = 0;  // at the look before
  bool done = false;
  std::vector<double> at_peak;  // position at the last peak
};

template <class V>
RelaxOutput relax_lanes(const RunInput& in, const RelaxOptions& options) {
  const auto m = unpack_materials<V>(*in.sheet, in.materials.data(), in.surroundings.data(), in.lanes, in.held);
  Workspace<V> w(*in.sheet);
  RunInput still = in;
  still.steps = 0;  // held_corners hold one entry a lane
  still.step_s = options.step_s;
  load_state(still, w);
  const size_t n = w.x.size();
  for (const HeldVertex& held : in.held) w.x[static_cast<size_t>(held.vertex)] = held_position<V>(still, held, 0);

  RelaxOutput out;
  out.position.resize(static_cast<size_t>(in.lanes) * n * 3);
  out.at_rest.assign(static_cast<size_t>(in.lanes), false);
  out.steps.assign(static_cast<size_t>(in.lanes), options.max_steps);
  std::vector<LaneRest> rest(static_cast<size_t>(in.lanes));
  const auto keep = [&](int i, std::vector<double>& to, size_t offset) {
    for (size_t v = 0; v < n; ++v) store_run(w.x[v], i, &to[offset + 3 * v]);
  };
  const int look_every = std::max(1, static_cast<int>(std::lround(options.check_s / options.step_s)));
  int open = in.lanes;
  for (int step = 0; step < options.max_steps && open > 0; ++step) {
    accelerations(*in.sheet, m, w, kBroughtFromFlat);
    for (size_t v = 0; v < n; ++v) w.v[v] = add_scaled(options.step_s, w.acceleration[v], w.v[v]);
    zero_held(in, w.v);
    for (size_t v = 0; v < n; ++v) w.x[v] = add_scaled(options.step_s, w.v[v], w.x[v]);
    if ((step + 1) % look_every != 0) continue;

    const auto now = motion_of_all(m.vertex, w);
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
      for (size_t v = 0; v < n; ++v) set_run(w.v[v], i, 0, 0, 0);
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
