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

// The fabric's weight, added to the force.
template <class V, class T>
void add_weight(const Run<T>& run, V* force) {
  const int n = run.u.functions, nv = run.v.functions, field = n * nv;
  const LaneMaterial<V> m = material_of<V>(run);
  const V* scale = lanes<V>(run.mass_scale);
  const V density = T(1) / m[kInverseDensity];
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < n; ++i) {
      const int at = j * n + i;
      V mass = run.u.area[i] * run.v.area[j] * density;
      if (scale) mass /= scale[at] * scale[at];
      for (int c = 0; c < 3; ++c) force[c * field + at] = fused(mass, m[Row(kGravityX + c)], force[c * field + at]);
    }
}

// Entry d of row i of an inverse of one direction, shared by the lanes or not.
template <class V, class T>
struct SharedInverse {
  const T* band;
  static constexpr int reach = 6;
  V operator()(int i, int d) const { return same<V>(band[13 * i + 6 + d]); }
};
template <class V>
struct LaneInverse {
  const V* band;
  int reach;
  V operator()(int i, int d) const { return band[(2 * reach + 1) * i + reach + d]; }
};

template <class Inverse>
inline int low_of(const Inverse& inverse, int i) {
  return i < inverse.reach ? -i : -inverse.reach;
}
template <class Inverse>
inline int high_of(const Inverse& inverse, int i, int count) {
  return count - 1 - i < inverse.reach ? count - 1 - i : inverse.reach;
}

// row[i] = Σ_d weight[d] from[d · n + i], `count` terms, as many columns at once as registers hold.
template <class V>
inline void sum_of_rows(const V* weight, int count, const V* from, int n, V* row) {
  int i = 0;
  for (; i + 4 <= n; i += 4) {
    V a{}, b{}, c{}, d{};
    const V* y = from + i;
    for (int k = 0; k < count; ++k, y += n) {
      a = fused(weight[k], y[0], a);
      b = fused(weight[k], y[1], b);
      c = fused(weight[k], y[2], c);
      d = fused(weight[k], y[3], d);
    }
    row[i] = a, row[i + 1] = b, row[i + 2] = c, row[i + 3] = d;
  }
  for (; i < n; ++i) {
    V a{};
    for (int k = 0; k < count; ++k) a = fused(weight[k], from[k * n + i], a);
    row[i] = a;
  }
}

// to = (inverse_u ⊗ inverse_v) from / density.
template <class V, class T, class Inverse>
inline void times_inverses(const Run<T>& run, const Inverse& along, const Inverse& down, const V* from, V* to) {
  const int n = run.u.functions, nv = run.v.functions, field = n * nv;
  V *x = lanes<V>(run.scratch), *y = x + n, *z = y + n;
  const V density = material_of<V>(run)[kInverseDensity];
  V* weight = x + 18 * n + 6 * run.held.count;  // behind the rows and what is held (advance)
  for (int j = 0; j < nv; ++j) {
    const int first = low_of(down, j), count = high_of(down, j, nv) - first + 1;
    for (int k = 0; k < count; ++k) weight[k] = density * down(j, first + k);
    for (int c = 0; c < 3; ++c)
      sum_of_rows(static_cast<const V*>(weight), count, from + c * field + (j + first) * n, n, x + c * n);
    V* out = to + j * n;
    for (int i = 0; i < n; ++i) {
      V sum_x{}, sum_y{}, sum_z{};
      for (int d = low_of(along, i); d <= high_of(along, i, n); ++d) {
        const V w = along(i, d);
        sum_x = fused(w, x[i + d], sum_x);
        sum_y = fused(w, y[i + d], sum_y);
        sum_z = fused(w, z[i + d], sum_z);
      }
      out[i] = sum_x;
      out[field + i] = sum_y;
      out[2 * field + i] = sum_z;
    }
  }
}

// to: what the force `from` accelerates, m/s². Overwrites `from`.
template <class V, class T>
void times_inverse_mass(const Run<T>& run, V* from, V* to) {
  scale_by_mass(run, from);
  if (run.inverse_u) {
    const LaneInverse<V> along{lanes<V>(run.inverse_u), run.inverse_reach},
        down{lanes<V>(run.inverse_v), run.inverse_reach};
    times_inverses(run, along, down, static_cast<const V*>(from), to);
  } else {
    const SharedInverse<V, T> along{run.u.inverse}, down{run.v.inverse};
    times_inverses(run, along, down, static_cast<const V*>(from), to);
  }
  scale_by_mass(run, to);
}

// Σ weight y over what a grip reads, one axis.
template <class V, class T>
inline V read_held(const HeldTables<T>& held, int k, const V* y) {
  V sum{};
  for (int e = held.reads_start[k]; e < held.reads_start[k + 1]; ++e)
    sum = fused(same<V>(held.reads_weight[e]), y[held.reads_point[e]], sum);
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

// Accelerations from the velocities v with which each grip is where it is to be at the step's end; a tenth of where it
// is off is taken back in a step: rounding of positions must not shake it.
template <class V, class T>
void wanted_of_held(const Run<T>& run, V* wanted, const V* v) {
  const int field = run.u.functions * run.v.functions;
  const V *position = lanes<V>(static_cast<const T*>(run.held.position)),
          *velocity = lanes<V>(static_cast<const T*>(run.held.velocity));
  const T per_step = T(1) / run.step_s;
  for (int k = 0; k < run.held.count; ++k)
    for (int c = 0; c < 3; ++c) {
      const V off = position[3 * k + c] - read_held(run.held, k, lanes<V>(static_cast<const T*>(run.x)) + c * field);
      const V to = velocity[3 * k + c] + T(0.1) * per_step * off;
      wanted[3 * k + c] = (to - read_held(run.held, k, v + c * field)) * per_step;
    }
}

template <class V, class T>
void advance(const Run<T>& run) {
  const int all = 3 * run.u.functions * run.v.functions;
  V *a = lanes<V>(run.acceleration), *force = lanes<V>(run.force), *v = lanes<V>(run.v_half), *x = lanes<V>(run.x);
  // Rows of scratch serve the mass, so that what is held lies in the fields behind them.
  V *wanted = lanes<V>(run.scratch) + 18 * run.u.functions, *lack = wanted + 3 * run.held.count;
  add_weight(run, force);
  if (run.air) {
    set_air<V>(run);
    carry_air(run, force);
  }
  times_inverse_mass(run, force, a);
  wanted_of_held(run, wanted, static_cast<const V*>(v));
  make_held(run, a, static_cast<const V*>(wanted), lack);
  if (run.air) carry_air(run, a);
  V *now = lanes<V>(run.change[0]), *before = lanes<V>(run.change[1]), *next = lanes<V>(run.change[2]);
  const V first = same<V>(run.gain[0] * run.step_s);
  for (int i = 0; i < all; ++i) now[i] = first * a[i];
  for (int s = 1; s < run.stages; ++s) {
    damping_forces(run, static_cast<const V*>(now));
    if (run.air) carry_air(run, force);
    times_inverse_mass(run, force, next);
    make_held(run, next, static_cast<const V*>(nullptr), lack);
    if (run.air) carry_air(run, next);
    const V mu = same<V>(run.mu[s]), nu = same<V>(s > 1 ? run.nu[s] : T(0)), gain = same<V>(run.gain[s] * run.step_s);
    for (int i = 0; i < all; ++i) next[i] = fused(mu, now[i], fused(nu, before[i], gain * (a[i] + next[i])));
    V* const last = before;
    before = now;
    now = next;
    next = last;
  }
  for (int i = 0; i < all; ++i) v[i] += now[i];
  const V h = same<V>(run.step_s);
  for (int i = 0; i < all; ++i) x[i] = fused(h, v[i], x[i]);
}

}  // namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND
