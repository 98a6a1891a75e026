// From forces to the next half step: mass, what is held, and the stages of damping (cloth/kernel/run.h).
#pragma once

#include "cloth/spline/kernel/carried_air.h"

namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND {

// The force's share of a control point under an uneven mass; and at the end once more.
template <class V, class T>
inline void scale_by_mass(const Run<T>& run, V* y) {
  if (!run.mass_scale) return;
  const V* scale = lanes<V>(run.mass_scale);
  const int field = run.u.functions * run.v.functions;
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < field; ++i) y[c * field + i] *= scale[i];
}

// to = (R ⊗ R) from / density.
template <class V, class T>
void times_inverse_mass(const Run<T>& run, V* from, V* to) {
  const int n = run.u.functions, nv = run.v.functions, field = n * nv;
  V* row = lanes<V>(run.scratch);
  const V inverse = material_of<V>(run)[kInverseDensity];
  scale_by_mass(run, from);
  for (int c = 0; c < 3; ++c)
    for (int j = 0; j < nv; ++j) {
      const int low = j < 6 ? -j : -6, high = nv - 1 - j < 6 ? nv - 1 - j : 6;
      clear(row, n);
      for (int d = low; d <= high; ++d) {
        const V w = inverse * run.v.inverse[13 * j + 6 + d];
        const V* y = from + c * field + (j + d) * n;
        for (int i = 0; i < n; ++i) row[i] = fused(w, y[i], row[i]);
      }
      V* out = to + c * field + j * n;
      for (int i = 0; i < n; ++i) {
        const int left = i < 6 ? -i : -6, right = n - 1 - i < 6 ? n - 1 - i : 6;
        V sum{};
        for (int d = left; d <= right; ++d) sum = fused(V{} + run.u.inverse[13 * i + 6 + d], row[i + d], sum);
        out[i] = sum;
      }
    }
  scale_by_mass(run, to);
}

// y ← (1 + damp_v) (1 + damp_u) y − twist_v twist_u y; other: two fields of one axis beside.
template <class V, class T>
void damp_bending(const Run<T>& run, V* y, V* other) {
  const int n = run.u.functions, nv = run.v.functions, field = n * nv;
  const V *along = lanes<V>(run.damp_u), *down = lanes<V>(run.damp_v);
  const V *twist_along = lanes<V>(run.twist_u), *twist_down = lanes<V>(run.twist_v);
  for (int c = 0; c < 3; ++c) {
    V* of = y + c * field;
    for (int j = 0; j < nv; ++j) {
      const int low = j < 6 ? -j : -6, high = nv - 1 - j < 6 ? nv - 1 - j : 6;
      V *row = other + j * n, *twisted = row + field;
      for (int i = 0; i < n; ++i) row[i] = of[j * n + i], twisted[i] = V{};
      for (int d = low; d <= high; ++d) {
        const V p = down[13 * j + 6 + d], q = twist_down[13 * j + 6 + d];
        for (int i = 0; i < n; ++i) {
          const V from = of[(j + d) * n + i];
          row[i] = fused(p, from, row[i]);
          twisted[i] = fused(q, from, twisted[i]);
        }
      }
    }
    for (int j = 0; j < nv; ++j)
      for (int i = 0; i < n; ++i) {
        const int left = i < 6 ? -i : -6, right = n - 1 - i < 6 ? n - 1 - i : 6;
        const V *row = other + j * n + i, *twisted = row + field;
        V sum = *row, less{};
        for (int d = left; d <= right; ++d) {
          sum = fused(along[13 * i + 6 + d], row[d], sum);
          less = fused(twist_along[13 * i + 6 + d], twisted[d], less);
        }
        of[j * n + i] = sum - less;
      }
  }
}

// Σ weight y over what a grip reads, one axis.
template <class V, class T>
inline V read_held(const HeldTables<T>& held, int k, const V* y) {
  V sum{};
  for (int e = held.reads_start[k]; e < held.reads_start[k + 1]; ++e)
    sum = fused(V{} + held.reads_weight[e], y[held.reads_point[e]], sum);
  return sum;
}

// Moves y so that each grip reads what `wanted` has ([held][axis]); lack: room for as many.
template <class V, class T>
void make_held(const Run<T>& run, V* y, const V* wanted, V* lack) {
  const HeldTables<T>& held = run.held;
  const int field = run.u.functions * run.v.functions;
  const V* weight = lanes<V>(held.moves_weight);
  for (int k = 0; k < held.count; ++k)
    for (int c = 0; c < 3; ++c)
      lack[3 * k + c] = (wanted ? wanted[3 * k + c] : V{}) - read_held(held, k, y + c * field);
  for (int k = 0; k < held.count; ++k)
    for (int e = held.moves_start[k]; e < held.moves_start[k + 1]; ++e)
      for (int c = 0; c < 3; ++c) {
        V& to = y[c * field + held.moves_point[e]];
        to = fused(weight[e], lack[3 * k + c], to);
      }
}

// Velocities over the step with which each grip is where it is to be at its end; a tenth of where it is off is taken
// back in a step: rounding of positions must not shake it. v: these as accelerations from the velocities v, null: not.
template <class V, class T>
void wanted_of_held(const Run<T>& run, V* wanted, const V* v) {
  const int field = run.u.functions * run.v.functions;
  const V *position = lanes<V>(static_cast<const T*>(run.held.position)),
          *velocity = lanes<V>(static_cast<const T*>(run.held.velocity));
  const T per_step = T(1) / run.step_s;
  for (int k = 0; k < run.held.count; ++k)
    for (int c = 0; c < 3; ++c) {
      const V off = position[3 * k + c] - read_held(run.held, k, lanes<V>(static_cast<const T*>(run.x)) + c * field);
      V& to = wanted[3 * k + c];
      to = velocity[3 * k + c] + T(0.1) * per_step * off;
      if (v) to = (to - read_held(run.held, k, v + c * field)) * per_step;
    }
}

// Of a whole step; other, before: fields that nothing else needs.
template <class V, class T>
void take_bending_damping(const Run<T>& run, V* v, V* other, V* before) {
  if (!run.air) {
    damp_bending(run, v, other);
    return;
  }
  const int all = 3 * run.u.functions * run.v.functions;
  for (int i = 0; i < all; ++i) before[i] = v[i];
  carry_air(run, v);
  damp_bending(run, v, other);
  carry_air_between(run, static_cast<const V*>(before), v);
}

template <class V, class T>
void advance(const Run<T>& run) {
  const int field = run.u.functions * run.v.functions, all = 3 * field;
  const LaneMaterial<V> m = material_of<V>(run);
  V *a = lanes<V>(run.acceleration), *force = lanes<V>(run.force), *v = lanes<V>(run.v_half), *x = lanes<V>(run.x);
  // Rows of scratch serve the mass, so that what is held lies in the fields behind them.
  V *wanted = lanes<V>(run.scratch) + 18 * run.u.functions, *lack = wanted + 3 * run.held.count;
  if (run.air) {
    set_air<V>(run);
    carry_air_under_weight(run, force);
  }
  times_inverse_mass(run, force, a);
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < field; ++i) a[c * field + i] += m[Row(kGravityX + c)];
  wanted_of_held(run, wanted, static_cast<const V*>(v));
  make_held(run, a, static_cast<const V*>(wanted), lack);
  if (run.air) carry_air(run, a);
  V *now = lanes<V>(run.change[0]), *before = lanes<V>(run.change[1]), *next = lanes<V>(run.change[2]);
  const V first = V{} + run.gain[0] * run.step_s;
  for (int i = 0; i < all; ++i) now[i] = first * a[i];
  for (int s = 1; s < run.stages; ++s) {
    damping_forces(run, static_cast<const V*>(now));
    if (run.air) carry_air(run, force);
    times_inverse_mass(run, force, next);
    make_held(run, next, static_cast<const V*>(nullptr), lack);
    if (run.air) carry_air(run, next);
    const V mu = V{} + run.mu[s], nu = V{} + (s > 1 ? run.nu[s] : T(0)), gain = V{} + run.gain[s] * run.step_s;
    for (int i = 0; i < all; ++i) next[i] = fused(mu, now[i], fused(nu, before[i], gain * (a[i] + next[i])));
    V* const last = before;
    before = now;
    now = next;
    next = last;
  }
  for (int i = 0; i < all; ++i) v[i] += now[i];
  if (run.damp_u) {
    take_bending_damping(run, v, next, before);
    wanted_of_held(run, wanted, static_cast<const V*>(nullptr));
    make_held(run, v, static_cast<const V*>(wanted), lack);
  }
  const V h = V{} + run.step_s;
  for (int i = 0; i < all; ++i) x[i] = fused(h, v[i], x[i]);
}

}  // namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND
