// Forces of a spline sheet by sum factorisation: along v into rows, along u at the points, and back the same way.
#pragma once

#include "cloth/spline/kernel/point_law.h"

namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND {

// A field's numbers as vectors of lanes.
template <class V, class T>
inline V* lanes(T* field) {
  return reinterpret_cast<V*>(field);
}
template <class V, class T>
inline const V* lanes(const T* field) {
  return reinterpret_cast<const V*>(field);
}

// to[i] = Σ_a weight[a] from[a · stride + i] for a row of a field.
template <class V, class T>
inline void gather_rows(const T* weight, const V* from, int stride, int count, V* to) {
  const V w0 = same<V>(weight[0]), w1 = same<V>(weight[1]), w2 = same<V>(weight[2]), w3 = same<V>(weight[3]);
  for (int i = 0; i < count; ++i)
    to[i] = fused(w3, from[3 * stride + i], fused(w2, from[2 * stride + i], fused(w1, from[stride + i], w0 * from[i])));
}

// Two such sums of one reading.
template <class V, class T>
inline void gather_both(const T* first, const T* second, const V* from, int stride, int count, V* to, V* to_second) {
  const V a0 = same<V>(first[0]), a1 = same<V>(first[1]), a2 = same<V>(first[2]), a3 = same<V>(first[3]);
  const V b0 = same<V>(second[0]), b1 = same<V>(second[1]), b2 = same<V>(second[2]), b3 = same<V>(second[3]);
  for (int i = 0; i < count; ++i) {
    const V y0 = from[i], y1 = from[stride + i], y2 = from[2 * stride + i], y3 = from[3 * stride + i];
    to[i] = fused(a3, y3, fused(a2, y2, fused(a1, y1, a0 * y0)));
    to_second[i] = fused(b3, y3, fused(b2, y2, fused(b1, y1, b0 * y0)));
  }
}

template <class V, class T>
inline V sum_of_four(const T* weight, const V* from) {
  return fused(same<V>(weight[3]), from[3],
               fused(same<V>(weight[2]), from[2], fused(same<V>(weight[1]), from[1], same<V>(weight[0]) * from[0])));
}

// The same of the three axes' rows.
template <class V, class T>
inline Vec3<V> point_of(const T* weight, const V* rows, int stride) {
  return {sum_of_four(weight, rows), sum_of_four(weight, rows + stride), sum_of_four(weight, rows + 2 * stride)};
}

// rows[axis][i + a] += value[a] p + slope[a] q.
template <class V, class T>
inline void scatter_point(const T* weight, const Vec3<V>& p, V* rows, int stride) {
  const V* of = &p.x;
  for (int c = 0; c < 3; ++c)
    for (int a = 0; a < 4; ++a) rows[c * stride + a] = fused(same<V>(weight[a]), of[c], rows[c * stride + a]);
}

// force rows += first[a] g + second[a] h.
template <class V, class T>
inline void scatter_rows(const T* first, const T* second, const V* g, const V* h, int stride, int count, V* force) {
  const V p0 = same<V>(first[0]), p1 = same<V>(first[1]), p2 = same<V>(first[2]), p3 = same<V>(first[3]);
  const V q0 = same<V>(second[0]), q1 = same<V>(second[1]), q2 = same<V>(second[2]), q3 = same<V>(second[3]);
  for (int i = 0; i < count; ++i) {
    const V from_g = g[i], from_h = h[i];
    V* to = force + i;
    to[0] = fused(q0, from_h, fused(p0, from_g, to[0]));
    to[stride] = fused(q1, from_h, fused(p1, from_g, to[stride]));
    to[2 * stride] = fused(q2, from_h, fused(p2, from_g, to[2 * stride]));
    to[3 * stride] = fused(q3, from_h, fused(p3, from_g, to[3 * stride]));
  }
}

template <class V>
inline void clear(V* rows, int count) {
  for (int i = 0; i < count; ++i) rows[i] = V{};
}

// Rows of one row of points: values and slopes along v of three axes.
template <class V>
struct PointRows {
  V *value, *slope;
};

// Membrane and drag; adds to the force.
template <class V, class T>
void add_membrane_and_drag(const Run<T>& run) {
  const int n = run.u.functions, field = n * run.v.functions, nq = run.u.points;
  const LaneMaterial<V> m = material_of<V>(run);
  V* rows = lanes<V>(run.scratch);
  const PointRows<V> x{rows, rows + 3 * n}, v{rows + 6 * n, rows + 9 * n}, g{rows + 12 * n, rows + 15 * n};
  V *memory = lanes<V>(run.membrane_memory), *force = lanes<V>(run.force);
  KeptPoint<V>* kept = reinterpret_cast<KeptPoint<V>*>(run.kept);
  for (int qv = 0; qv < run.v.points; ++qv) {
    const int row = run.v.first[qv] * n;
    const T *value = run.v.value + 4 * qv, *slope = run.v.slope + 4 * qv;
    for (int c = 0; c < 3; ++c) {
      gather_both(value, slope, lanes<V>(run.x) + c * field + row, n, n, x.value + c * n, x.slope + c * n);
      gather_both(value, slope, lanes<V>(run.v_half) + c * field + row, n, n, v.value + c * n, v.slope + c * n);
    }
    clear(g.value, 6 * n);
    for (int qu = 0; qu < nq; ++qu) {
      const int s = run.u.first[qu];
      const T *f = run.u.value + 4 * qu, *d = run.u.slope + 4 * qu;
      const PointMotion<V> p{point_of(d, x.value + s, n), point_of(f, x.slope + s, n), point_of(d, v.value + s, n),
                             point_of(f, v.slope + s, n), point_of(f, v.value + s, n)};
      const int point = qv * nq + qu;
      const PointPull<V> pull = point_pull(p, m, same<V>(run.u.weight[qu] * run.v.weight[qv]),
                                           memory ? memory + kMembraneMemory * point : nullptr, run.memory_step_s,
                                           kept ? kept + point : nullptr);
      scatter_point(f, pull.value, g.value + s, n);
      scatter_point(d, (V{} - T(1)) * pull.u, g.value + s, n);
      scatter_point(f, (V{} - T(1)) * pull.v, g.slope + s, n);
    }
    for (int c = 0; c < 3; ++c)
      scatter_rows(value, slope, g.value + c * n, g.slope + c * n, n, n, force + c * field + row);
  }
}

// Membrane damping of the velocities y at the shape that was kept; adds to the force.
template <class V, class T>
void add_membrane_damping(const Run<T>& run, const V* y) {
  const int n = run.u.functions, field = n * run.v.functions, nq = run.u.points;
  V* rows = lanes<V>(run.scratch);
  const PointRows<V> v{rows, rows + 3 * n}, g{rows + 6 * n, rows + 9 * n};
  const KeptPoint<V>* kept = reinterpret_cast<const KeptPoint<V>*>(run.kept);
  for (int qv = 0; qv < run.v.points; ++qv) {
    const int row = run.v.first[qv] * n;
    const T *value = run.v.value + 4 * qv, *slope = run.v.slope + 4 * qv;
    for (int c = 0; c < 3; ++c) gather_both(value, slope, y + c * field + row, n, n, v.value + c * n, v.slope + c * n);
    clear(g.value, 6 * n);
    for (int qu = 0; qu < nq; ++qu) {
      const int s = run.u.first[qu];
      const T *f = run.u.value + 4 * qu, *d = run.u.slope + 4 * qu;
      const PointPull<V> pull =
          point_damping(kept[qv * nq + qu], point_of(d, v.value + s, n), point_of(f, v.slope + s, n));
      scatter_point(d, (V{} - T(1)) * pull.u, g.value + s, n);
      scatter_point(f, (V{} - T(1)) * pull.v, g.slope + s, n);
    }
    for (int c = 0; c < 3; ++c)
      scatter_rows(value, slope, g.value + c * n, g.slope + c * n, n, n, lanes<V>(run.force) + c * field + row);
  }
}

// Σ_d of three rows by their bands at i, columns i − 3 … i + 3.
template <class V, class T>
inline V band_sum(const SideTables<T>& u, const V* a, const V* b, const V* c, int i) {
  const int low = i < 3 ? -i : -3, high = u.functions - 1 - i < 3 ? u.functions - 1 - i : 3;
  V first{}, second{}, third{};
  for (int d = low; d <= high; ++d) {
    const int at = 7 * i + 3 + d;
    first = fused(same<V>(u.bend[at]), a[i + d], first);
    second = fused(same<V>(u.slope_product[at]), b[i + d], second);
    third = fused(same<V>(u.mass[at]), c[i + d], third);
  }
  return first + second + third;
}

// force −= (mass ⊗ bend + slope ⊗ slope + bend ⊗ mass) of uu, uv, vv, fields of one axis; rows: 3 n of scratch.
template <class V, class T>
void subtract_bending(const Run<T>& run, const V* uu, const V* uv, const V* vv, V* rows, V* force) {
  const int n = run.u.functions, nv = run.v.functions;
  V *a = rows, *b = rows + n, *c = rows + 2 * n;
  for (int j = 0; j < nv; ++j) {
    const int low = j < 3 ? -j : -3, high = nv - 1 - j < 3 ? nv - 1 - j : 3;
    const T *mass = run.v.mass + 7 * j + 3, *slope = run.v.slope_product + 7 * j + 3, *bend = run.v.bend + 7 * j + 3;
    for (int i = 0; i < n; ++i) {
      V sum_a{}, sum_b{}, sum_c{};
      for (int d = low; d <= high; ++d) {
        const int from = (j + d) * n + i;
        sum_a = fused(same<V>(mass[d]), uu[from], sum_a);
        sum_b = fused(same<V>(slope[d]), uv[from], sum_b);
        sum_c = fused(same<V>(bend[d]), vv[from], sum_c);
      }
      a[i] = sum_a, b[i] = sum_b, c[i] = sum_c;
    }
    for (int i = 0; i < n; ++i)
      force[j * n + i] -=
          band_sum(run.u, static_cast<const V*>(a), static_cast<const V*>(b), static_cast<const V*>(c), i);
  }
}

// Bending of even rigidities and its damping. Sets the force.
template <class V, class T>
void set_bending(const Run<T>& run) {
  const int n = run.u.functions, field = n * run.v.functions;
  const LaneMaterial<V> m = material_of<V>(run);
  V *rows = lanes<V>(run.scratch), *uu = rows + 18 * n, *uv = uu + field, *vv = uv + field;
  const V damping = m[kBendDamping], twist = T(2) * m[kBendUV], twist_damping = T(2) * damping;
  for (int c = 0; c < 3; ++c) {
    V* force = lanes<V>(run.force) + c * field;
    const V* x = lanes<V>(static_cast<const T*>(run.x)) + c * field;
    const V* v = lanes<V>(static_cast<const T*>(run.v_half)) + c * field;
    for (int i = 0; i < field; ++i) {
      force[i] = V{};
      uu[i] = fused(m[kBendUU], x[i], damping * v[i]);
      uv[i] = fused(twist, x[i], twist_damping * v[i]);
      vv[i] = fused(m[kBendVV], x[i], damping * v[i]);
    }
    subtract_bending(run, uu, uv, vv, rows, force);
  }
}

// Rows of one row of points with second derivatives along v.
template <class V>
struct SecondRows {
  V *value, *slope, *second;
};

template <class V, class T>
inline SecondRows<V> gather_seconds(const Run<T>& run, const V* field_of, int qv, V* rows) {
  const int n = run.u.functions, field = n * run.v.functions, row = run.v.first[qv] * n;
  const SecondRows<V> to{rows, rows + 3 * n, rows + 6 * n};
  for (int c = 0; c < 3; ++c) {
    const V* from = field_of + c * field + row;
    gather_both(run.v.value + 4 * qv, run.v.slope + 4 * qv, from, n, n, to.value + c * n, to.slope + c * n);
    gather_rows(run.v.second + 4 * qv, from, n, n, to.second + c * n);
  }
  return to;
}

template <class V, class T>
inline Seconds<V> seconds_at(const Run<T>& run, const SecondRows<V>& rows, int qu) {
  const int n = run.u.functions, s = run.u.first[qu];
  return {point_of(run.u.second + 4 * qu, rows.value + s, n), point_of(run.u.slope + 4 * qu, rows.slope + s, n),
          point_of(run.u.value + 4 * qu, rows.second + s, n)};
}

// What of bending is not three even rigidities, at the points of the rule; adds to the force.
template <class V, class T>
void add_other_moments(const Run<T>& run) {
  const int n = run.u.functions, field = n * run.v.functions, nq = run.u.points;
  const LaneMaterial<V> m = material_of<V>(run);
  // Nine rows each of positions, velocities and pulls; the first of the fields of scratch serve for what 18 lack.
  V *first = lanes<V>(run.scratch), *g = first + 18 * n;
  V* memory = lanes<V>(run.bend_memory);
  const V* factor = lanes<V>(run.bend_factor);
  for (int qv = 0; qv < run.v.points; ++qv) {
    const SecondRows<V> x = gather_seconds(run, lanes<V>(static_cast<const T*>(run.x)), qv, first);
    SecondRows<V> v = x;
    if (memory) v = gather_seconds(run, lanes<V>(static_cast<const T*>(run.v_half)), qv, first + 9 * n);
    clear(g, 9 * n);
    for (int qu = 0; qu < nq; ++qu) {
      const int s = run.u.first[qu], point = qv * nq + qu;
      const T *value = run.u.value + 4 * qu, *slope = run.u.slope + 4 * qu;
      Vec3<V> normal{};
      if (run.uses_normals) {
        normal = cross(point_of(slope, x.value + s, n), point_of(value, x.slope + s, n));
        normal = (T(1) / (root(dot(normal, normal)) + T(1e-20))) * normal;
      }
      const Seconds<V> shape = seconds_at(run, x, qu), rate = memory ? seconds_at(run, v, qu) : Seconds<V>{};
      const Seconds<V> moment =
          moments_beside_even(shape, rate, normal, m, factor ? factor + point : nullptr,
                              memory ? memory + kBendMemory * point : nullptr, run.memory_step_s, run.uses_normals);
      const V weight = V{} - run.u.weight[qu] * run.v.weight[qv];
      scatter_point(run.u.second + 4 * qu, weight * moment.uu, g + s, n);
      scatter_point(slope, (T(2) * weight) * moment.uv, g + 3 * n + s, n);
      scatter_point(value, weight * moment.vv, g + 6 * n + s, n);
    }
    for (int c = 0; c < 3; ++c)
      for (int a = 0; a < 4; ++a) {
        const V p = same<V>(run.v.value[4 * qv + a]), q = same<V>(run.v.slope[4 * qv + a]),
                r = same<V>(run.v.second[4 * qv + a]);
        V* to = lanes<V>(run.force) + c * field + (run.v.first[qv] + a) * n;
        const V *gc = g + c * n, *hc = g + (3 + c) * n, *kc = g + (6 + c) * n;
        for (int i = 0; i < n; ++i) to[i] = fused(r, kc[i], fused(q, hc[i], fused(p, gc[i], to[i])));
      }
  }
}

template <class V, class T>
void forces(const Run<T>& run) {
  set_bending<V>(run);
  if (run.uses_moments) add_other_moments<V>(run);
  add_membrane_and_drag<V>(run);
}

// Of the membrane alone: the masses bear bending's damping (damped_inertia.h).
template <class V, class T>
void damping_forces(const Run<T>& run, const V* velocity) {
  clear(lanes<V>(run.force), 3 * run.u.functions * run.v.functions);
  add_membrane_damping(run, velocity);
}

}  // namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND
