#include "hardware_sim/world/sheet_forces.h"

#include <algorithm>
#include <cmath>
#include <utility>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SELVEDGE_CLONES __attribute__((target_clones("avx2", "default")))
#define SELVEDGE_INLINE __attribute__((always_inline)) inline
#else
#define SELVEDGE_CLONES
#define SELVEDGE_INLINE inline
#endif

namespace selvedge::hardware_sim {

namespace {

// The cubic through four nodes, one and two places before the first.
constexpr double kGhost[2][4] = {{4, -6, 4, -1}, {10, -20, 15, -4}};

constexpr double kFirst[5] = {1.0 / 12, -8.0 / 12, 0, 8.0 / 12, -1.0 / 12};
constexpr double kSecond[5] = {-1.0 / 12, 16.0 / 12, -30.0 / 12, 16.0 / 12, -1.0 / 12};

// Integrals per cell from values at nodes, and in the middles of cells.
std::vector<double> node_weights(size_t count) {
  std::vector<double> wide(count + 2, 0.0);  // a ghost on either side
  for (size_t cell = 0; cell + 3 < wide.size(); ++cell)
    for (size_t k = 0; k < 4; ++k) wide[cell + k] += (k == 0 || k == 3 ? -1.0 : 13.0) / 24;
  std::vector<double> weights(wide.begin() + 1, wide.end() - 1);
  for (size_t k = 0; k < 4; ++k) {
    weights[k] += kGhost[0][k] * wide.front();
    weights[count - 1 - k] += kGhost[0][k] * wide.back();
  }
  return weights;
}

std::vector<double> middle_weights(size_t count) {
  std::vector<double> weights(count, 1.0);
  constexpr double change[3] = {2.0 / 24, -3.0 / 24, 1.0 / 24};
  for (size_t k = 0; k < 3; ++k) {
    weights[k] += change[k];
    weights[count - 1 - k] += change[k];
  }
  return weights;
}

// One line of values; all loops below run along u.
template <class T>
SELVEDGE_INLINE void combine4(T* __restrict out, const T* p0, const T* p1, const T* p2, const T* p3, T outer, T inner,
                              T sign, int from, int to) {
#pragma GCC ivdep
  for (int c = from; c < to; ++c) out[c] = inner * (p2[c] + sign * p1[c]) + outer * (p3[c] + sign * p0[c]);
}

template <class T>
SELVEDGE_INLINE void scale(T* __restrict out, const T* by, int from, int to) {
#pragma GCC ivdep
  for (int c = from; c < to; ++c) out[c] *= by[c];
}

template <class T>
SELVEDGE_INLINE void add4(T* __restrict out, const T* p0, const T* p1, const T* p2, const T* p3, T outer, T inner,
                          T sign, int from, int to) {
#pragma GCC ivdep
  for (int c = from; c < to; ++c) out[c] += inner * (p2[c] + sign * p1[c]) + outer * (p3[c] + sign * p0[c]);
}

template <class T>
SELVEDGE_INLINE void extend(const SheetGrid& g, T* plane) {
  const int last = g.columns - 1;
  for (int r = 0; r < g.rows; ++r) {
    T* row = plane + g.at(r, 0);
    for (int k = 0; k < 2; ++k) {
      T left = 0, right = 0;
      for (int i = 0; i < 4; ++i) {
        left += static_cast<T>(kGhost[k][i]) * row[i];
        right += static_cast<T>(kGhost[k][i]) * row[last - i];
      }
      row[-1 - k] = left;
      row[last + 1 + k] = right;
    }
  }
  for (int k = 0; k < 2; ++k)
    for (const int side : {1, -1}) {
      const int first = side > 0 ? 0 : g.rows - 1;
      T* __restrict out = plane + g.at(first - side * (1 + k), 0);
      const T *p0 = plane + g.at(first, 0), *p1 = plane + g.at(first + side, 0),
              *p2 = plane + g.at(first + 2 * side, 0), *p3 = plane + g.at(first + 3 * side, 0);
      const T w0 = static_cast<T>(kGhost[k][0]), w1 = static_cast<T>(kGhost[k][1]), w2 = static_cast<T>(kGhost[k][2]),
              w3 = static_cast<T>(kGhost[k][3]);
      for (int c = -2; c < g.columns + 2; ++c) out[c] = w0 * p0[c] + w1 * p1[c] + w2 * p2[c] + w3 * p3[c];
    }
}

// The transpose of `extend`: what pulls at the nodes beyond the rim pulls at those that they follow.
template <class T>
SELVEDGE_INLINE void hand_back(const SheetGrid& g, T* plane) {
  for (int k = 0; k < 2; ++k)
    for (const int side : {1, -1}) {
      const int first = side > 0 ? 0 : g.rows - 1;
      const T* beyond = plane + g.at(first - side * (1 + k), 0);
      for (int i = 0; i < 4; ++i) {
        T* __restrict out = plane + g.at(first + side * i, 0);
        const T w = static_cast<T>(kGhost[k][i]);
        for (int c = -2; c < g.columns + 2; ++c) out[c] += w * beyond[c];
      }
    }
  const int last = g.columns - 1;
  for (int r = 0; r < g.rows; ++r) {
    T* row = plane + g.at(r, 0);
    for (int k = 0; k < 2; ++k)
      for (int i = 0; i < 4; ++i) {
        row[i] += static_cast<T>(kGhost[k][i]) * row[-1 - k];
        row[last - i] += static_cast<T>(kGhost[k][i]) * row[last + 1 + k];
      }
  }
}

template <class T>
SELVEDGE_INLINE void clear(const SheetGrid& g, T* plane) {
  std::fill(plane, plane + g.size(), T(0));
}

// half: strain is ½ (p·p − 1), p and q the same; else p·q.
template <class T>
SELVEDGE_INLINE void strain_row(const T* p0, const T* p1, const T* p2, const T* q0, const T* q1, const T* q2,
                                T* __restrict strain, T* __restrict before, T* __restrict lag, T* __restrict stress,
                                T factor, T less, T stiffness, T keep, T gain, int n) {
#pragma GCC ivdep
  for (int c = 0; c < n; ++c) {
    const T e = factor * (p0[c] * q0[c] + p1[c] * q1[c] + p2[c] * q2[c] - less);
    const T m = keep * lag[c] + gain * (e - before[c]);
    before[c] = strain[c] = e;
    lag[c] = m;
    stress[c] = stiffness * e + m;
  }
}

}  // namespace

SheetLine::SheetLine(std::vector<double> places)
    : place(std::move(places)), node_weight(node_weights(place.size())),
      middle_weight(middle_weights(place.size() - 1)) {
  const size_t count = place.size();
  std::vector<double> wide(count + 4);  // two ghosts on either side
  std::copy(place.begin(), place.end(), wide.begin() + 2);
  for (size_t k = 0; k < 2; ++k) {
    wide[1 - k] = wide[count + 2 + k] = 0;
    for (size_t i = 0; i < 4; ++i) {
      wide[1 - k] += kGhost[k][i] * place[i];
      wide[count + 2 + k] += kGhost[k][i] * place[count - 1 - i];
    }
  }
  for (size_t c = 0; c + 1 < count; ++c) {
    const double* p = &wide[c + 1];
    const double length = (27 * (p[2] - p[1]) - (p[3] - p[0])) / 24;
    middle_scale.push_back(1 / length);
    middle_weight[c] *= length;
  }
  for (size_t c = 0; c < count; ++c) {
    double slope = 0, bend = 0;
    for (size_t k = 0; k < 5; ++k) {
      slope += kFirst[k] * wide[c + k];
      bend += kSecond[k] * wide[c + k];
    }
    node_weight[c] *= slope;
    for (size_t k = 0; k < 5; ++k) second[k].push_back((kSecond[k] - bend / slope * kFirst[k]) / (slope * slope));
  }
}

std::vector<double> graded_places(double length_m, int cells, double grading, bool both) {
  std::vector<double> places;
  const double turn = both ? 2 * M_PI : M_PI;
  for (int i = 0; i <= cells; ++i) {
    const double share = static_cast<double>(i) / cells;
    places.push_back(length_m * (share - grading * std::sin(turn * share) / turn));
  }
  return places;
}

SheetGrid::SheetGrid(std::vector<double> along_u, std::vector<double> along_v)
    : u(std::move(along_u)), v(std::move(along_v)), columns(u.nodes()), rows(v.nodes()),
      stride((columns + 2 * kBorder + 7) / 8 * 8) {}

template <class T>
SheetForces<T>::SheetForces(const SheetGrid& grid) : grid_(grid) {
  const auto make = [&](SheetPlane<T>& plane) { plane.assign(grid.size(), T(0)); };
  for (SheetField<T>* field : {&x, &v, &f, &a_, &b_, &at_centre_a_, &at_centre_b_, &sa_, &sb_, &lagging_, &before_})
    for (SheetPlane<T>& plane : *field) make(plane);
  for (StrainPlanes<T>* s : {&uu, &vv, &uv})
    for (SheetPlane<T>* plane : {&s->strain, &s->before, &s->lag, &s->stress}) make(*plane);
  for (SheetPlane<T>* plane : {&bent_, &moment_u_, &moment_v_, &half_, &twist_}) make(*plane);
  for (SheetPlane<T>& plane : weights_) make(plane);
  const auto fill = [&](SheetPlane<T>& plane, const std::vector<double>& along, const std::vector<double>& down) {
    for (size_t r = 0; r < down.size(); ++r)
      for (size_t c = 0; c < along.size(); ++c)
        plane[grid.at(static_cast<int>(r), static_cast<int>(c))] = static_cast<T>(along[c] * down[r]);
  };
  fill(weights_[0], grid.u.middle_weight, grid.v.node_weight);
  fill(weights_[1], grid.u.node_weight, grid.v.middle_weight);
  fill(weights_[2], grid.u.middle_weight, grid.v.middle_weight);
  fill(weights_[3], grid.u.node_weight, grid.v.node_weight);
  for (SheetPlane<T>& plane : pulls_) make(plane);
  const auto times = [](std::vector<double> a, const std::vector<double>& b) {
    for (size_t i = 0; i < a.size(); ++i) a[i] *= b[i];
    return a;
  };
  fill(pulls_[0], times(grid.u.middle_weight, grid.u.middle_scale), grid.v.node_weight);
  fill(pulls_[1], grid.u.node_weight, times(grid.v.middle_weight, grid.v.middle_scale));
  fill(pulls_[2], times(grid.u.middle_weight, grid.u.middle_scale), grid.v.middle_weight);
  fill(pulls_[3], grid.u.middle_weight, times(grid.v.middle_weight, grid.v.middle_scale));
  constexpr size_t border = SheetGrid::kBorder;
  const auto bordered = [&](const std::vector<double>& line, size_t room) {
    std::vector<T> out(room, T(0));
    for (size_t i = 0; i < line.size(); ++i) out[border + i] = static_cast<T>(line[i]);
    return out;
  };
  const auto wide = static_cast<size_t>(grid.stride), high = static_cast<size_t>(grid.rows) + 2 * border;
  scale_u_ = bordered(grid.u.middle_scale, wide);
  scale_v_ = bordered(grid.v.middle_scale, high);
  for (size_t k = 0; k < 5; ++k) {
    second_u_[k] = bordered(grid.u.second[k], wide);
    second_v_[k] = bordered(grid.v.second[k], high);
  }
}

template <class T>
SELVEDGE_INLINE void SheetForces<T>::strain_here(const SheetLaw& law) {
  const SheetGrid& g = grid_;
  const int columns = g.columns, rows = g.rows;
  const T is = static_cast<T>(27.0 / 24), os = static_cast<T>(-1.0 / 24);
  const T im = static_cast<T>(9.0 / 16), om = static_cast<T>(-1.0 / 16);
  const T *scale_u = scale_u_.data() + SheetGrid::kBorder, *scale_v = scale_v_.data() + SheetGrid::kBorder;
  for (size_t k = 0; k < 3; ++k) {
    T* place = x[k].data();
    extend(g, place);
    for (int r = -1; r <= rows; ++r) {
      const T* p = place + g.at(r, 0);
      combine4(a_[k].data() + g.at(r, 0), p - 1, p, p + 1, p + 2, os, is, T(-1), 0, columns - 1);
      scale(a_[k].data() + g.at(r, 0), scale_u, 0, columns - 1);
    }
    for (int r = 0; r + 1 < rows; ++r) {
      const T down = scale_v[r];
      combine4(b_[k].data() + g.at(r, 0), place + g.at(r - 1, 0), place + g.at(r, 0), place + g.at(r + 1, 0),
               place + g.at(r + 2, 0), down * os, down * is, T(-1), -1, columns + 1);
    }
    for (int r = 0; r + 1 < rows; ++r) {
      const T *a = a_[k].data(), *b = b_[k].data() + g.at(r, 0);
      combine4(at_centre_a_[k].data() + g.at(r, 0), a + g.at(r - 1, 0), a + g.at(r, 0), a + g.at(r + 1, 0),
               a + g.at(r + 2, 0), om, im, T(1), 0, columns - 1);
      combine4(at_centre_b_[k].data() + g.at(r, 0), b - 1, b, b + 1, b + 2, om, im, T(1), 0, columns - 1);
    }
  }
  const auto row_of = [&](const SheetField<T>& p, const SheetField<T>& q, StrainPlanes<T>& e, const StrainLaw& l, int r,
                          int n, T factor, T less) {
    const size_t at = g.at(r, 0);
    strain_row(p[0].data() + at, p[1].data() + at, p[2].data() + at, q[0].data() + at, q[1].data() + at,
               q[2].data() + at, e.strain.data() + at, e.before.data() + at, e.lag.data() + at, e.stress.data() + at,
               factor, less, static_cast<T>(l.stiffness), static_cast<T>(l.keep), static_cast<T>(l.gain), n);
  };
  for (int r = 0; r < rows; ++r) {
    row_of(a_, a_, uu, law.stretch, r, columns - 1, T(0.5), T(1));
    if (r + 1 == rows) break;
    row_of(b_, b_, vv, law.stretch, r, columns, T(0.5), T(1));
    row_of(at_centre_a_, at_centre_b_, uv, law.shear, r, columns - 1, T(1), T(0));
  }
}

template <class T>
SELVEDGE_INLINE void SheetForces<T>::pull_here(const SheetLaw& law) {
  const SheetGrid& g = grid_;
  const int columns = g.columns, rows = g.rows;
  const T is = static_cast<T>(27.0 / 24), os = static_cast<T>(-1.0 / 24);
  const T im = static_cast<T>(9.0 / 16), om = static_cast<T>(-1.0 / 16);
  const T *scale_u = scale_u_.data() + SheetGrid::kBorder, *scale_v = scale_v_.data() + SheetGrid::kBorder;
  std::array<const T*, 5> second_u, second_v;
  for (size_t k = 0; k < 5; ++k) {
    second_u[k] = second_u_[k].data() + SheetGrid::kBorder;
    second_v[k] = second_v_[k].data() + SheetGrid::kBorder;
  }
  const T rigidity = static_cast<T>(law.bend.stiffness), keep = static_cast<T>(law.bend.keep),
          gain = static_cast<T>(law.bend.gain);
  for (size_t k = 0; k < 3; ++k) {
    // Shear's pull at a and b of each centre, in the place of what it was made from; then all of a and b.
    for (int r = 0; r + 1 < rows; ++r) {
      const size_t at = g.at(r, 0);
      T* __restrict a = at_centre_a_[k].data() + at, * __restrict b = at_centre_b_[k].data() + at;
      const T *stress = uv.stress.data() + at, *wa = pulls_[2].data() + at, *wb = pulls_[3].data() + at;
#pragma GCC ivdep
      for (int c = 0; c < columns - 1; ++c) {
        const T a_was = a[c];
        a[c] = wa[c] * stress[c] * b[c];
        b[c] = wb[c] * stress[c] * a_was;
      }
    }
    T *sa = sa_[k].data(), *sb = sb_[k].data();
    const T *ca = at_centre_a_[k].data(), *cb = at_centre_b_[k].data();
    for (int r = -1; r <= rows; ++r) {
      const size_t at = g.at(r, 0);
      combine4(sa + at, ca + g.at(r - 2, 0), ca + g.at(r - 1, 0), ca + at, ca + g.at(r + 1, 0), om, im, T(1), 0,
               columns - 1);
      if (r < 0 || r == rows) continue;
      const T *a = a_[k].data() + at, *stress = uu.stress.data() + at, *w = pulls_[0].data() + at;
#pragma GCC ivdep
      for (int c = 0; c < columns - 1; ++c) sa[at + static_cast<size_t>(c)] += w[c] * stress[c] * a[c];
    }
    for (int r = 0; r + 1 < rows; ++r) {
      const size_t at = g.at(r, 0);
      const T* p = cb + at;
      combine4(sb + at, p - 2, p - 1, p, p + 1, om, im, T(1), -1, columns + 1);
      const T *b = b_[k].data() + at, *stress = vv.stress.data() + at, *w = pulls_[1].data() + at;
#pragma GCC ivdep
      for (int c = 0; c < columns; ++c) sb[at + static_cast<size_t>(c)] += w[c] * stress[c] * b[c];
    }

    // Bending: of the sheet as it is and as its dashpots lag, times their rigidities.
    T* bent = bent_.data();
    for (int r = 0; r < rows; ++r) {
      const size_t at = g.at(r, 0);
      const T* place = x[k].data() + at;
      T* __restrict lag = lagging_[k].data() + at, * __restrict before = before_[k].data() + at;
      T* __restrict out = bent + at;
#pragma GCC ivdep
      for (int c = 0; c < columns; ++c) {
        const T m = keep * lag[c] + gain * (place[c] - before[c]);
        before[c] = place[c];
        lag[c] = m;
        out[c] = rigidity * place[c] + m;
      }
    }
    extend(g, bent);
    T *mu = moment_u_.data(), *mv = moment_v_.data();
    const T* w = weights_[3].data();
    for (int r = 0; r < rows; ++r) {
      const size_t at = g.at(r, 0);
      const T *p0 = bent + g.at(r - 2, 0), *p1 = bent + g.at(r - 1, 0), *p = bent + at, *p3 = bent + g.at(r + 1, 0),
              *p4 = bent + g.at(r + 2, 0);
      T* __restrict along = mu + at, * __restrict down = mv + at;
      const T* area = w + at;
      const T v0 = second_v[0][r], v1 = second_v[1][r], v2 = second_v[2][r], v3 = second_v[3][r], v4 = second_v[4][r];
#pragma GCC ivdep
      for (int c = 0; c < columns; ++c) {
        along[c] = area[c] * (second_u[0][c] * p[c - 2] + second_u[1][c] * p[c - 1] + second_u[2][c] * p[c] +
                              second_u[3][c] * p[c + 1] + second_u[4][c] * p[c + 2]);
        down[c] = area[c] * (v0 * p0[c] + v1 * p1[c] + v2 * p[c] + v3 * p3[c] + v4 * p4[c]);
      }
    }
    // Twist: slopes along v, of these along u, weighed twice, and back along u, in one row's room.
    for (int r = 0; r + 1 < rows; ++r) {
      const size_t at = g.at(r, 0);
      const T down = scale_v[r];
      T *half = half_.data() + at, *twist = twist_.data() + at;
      combine4(half, bent + g.at(r - 1, 0), bent + at, bent + g.at(r + 1, 0), bent + g.at(r + 2, 0), down * os,
               down * is, T(-1), -1, columns + 1);
      combine4(twist, half - 1, half, half + 1, half + 2, os, is, T(-1), 0, columns - 1);
      const T* centre = pulls_[2].data() + at;
#pragma GCC ivdep
      for (int c = 0; c < columns - 1; ++c) twist[c] *= T(2) * down * centre[c] * scale_u[c];
      // To b's pull it adds what comes back along u; slopes along v then hand both on. −D_uᵀ, as for a.
      add4(sb + at, twist - 2, twist - 1, twist, twist + 1, -os, -is, T(-1), -1, columns + 1);
    }

    T* force = f[k].data();
    for (int r = -2; r < rows + 2; ++r) {
      const size_t at = g.at(r, 0);
      T* row = force + at;
      const T* a = sa + at;
      const T *m0 = mv + g.at(r - 2, 0), *m1 = mv + g.at(r - 1, 0), *m2 = mv + at, *m3 = mv + g.at(r + 1, 0),
              *m4 = mv + g.at(r + 2, 0), *m = mu + at;
      // Weights at the nodes that reach this one: −2 … 2 places away.
      const T v0 = second_v[4][r - 2], v1 = second_v[3][r - 1], v2 = second_v[2][r], v3 = second_v[1][r + 1],
              v4 = second_v[0][r + 2];
#pragma GCC ivdep
      for (int c = -2; c < columns + 2; ++c)
        row[c] = -(v0 * m0[c] + v1 * m1[c] + v2 * m2[c] + v3 * m3[c] + v4 * m4[c]) -
                 (second_u[4][c - 2] * m[c - 2] + second_u[3][c - 1] * m[c - 1] + second_u[2][c] * m[c] +
                  second_u[1][c + 1] * m[c + 1] + second_u[0][c + 2] * m[c + 2]);
      add4(row, a - 2, a - 1, a, a + 1, os, is, T(-1), -2, columns + 2);
      add4(row, sb + g.at(r - 2, 0), sb + g.at(r - 1, 0), sb + at, sb + g.at(r + 1, 0), os, is, T(-1), -2, columns + 2);
    }
    hand_back(g, force);
  }
}

template <class T>
SELVEDGE_INLINE void SheetForces<T>::drag_here(const SheetLaw& law, SheetField<T>& out) {
  const SheetGrid& g = grid_;
  const T wx = static_cast<T>(law.air[0]), wy = static_cast<T>(law.air[1]), wz = static_cast<T>(law.air[2]);
  const T normal = static_cast<T>(law.drag_normal), tangent = static_cast<T>(law.drag_tangent),
          fade = static_cast<T>(law.drag_fade);
  for (size_t k = 0; k < 3; ++k) extend(g, x[k].data());
  for (int r = 0; r < g.rows; ++r) {
    const size_t at = g.at(r, 0);
    const auto slope = [&](const T* p, std::ptrdiff_t next) {
      return T(8) * (p[next] - p[-next]) - (p[2 * next] - p[-2 * next]);
    };
    const T *px = x[0].data() + at, *py = x[1].data() + at, *pz = x[2].data() + at;
    const T *vx = v[0].data() + at, *vy = v[1].data() + at, *vz = v[2].data() + at;
    const T* area = weights_[3].data() + at;
    T* __restrict fx = out[0].data() + at, * __restrict fy = out[1].data() + at, * __restrict fz = out[2].data() + at;
#pragma GCC ivdep
    for (int c = 0; c < g.columns; ++c) {
      const T ax = slope(px + c, 1), ay = slope(py + c, 1), az = slope(pz + c, 1);
      const T bx = slope(px + c, g.stride), by = slope(py + c, g.stride), bz = slope(pz + c, g.stride);
      T nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
      const T per_length = T(1) / std::sqrt(nx * nx + ny * ny + nz * nz + T(1e-30));
      nx *= per_length;
      ny *= per_length;
      nz *= per_length;
      const T ux = vx[c] - wx, uy = vy[c] - wy, uz = vz[c] - wz;
      const T across = ux * nx + uy * ny + uz * nz;
      const T along = (tangent - normal * std::fabs(across) / (T(1) + fade * across * across)) * across;
      fx[c] = area[c] * (along * nx - tangent * ux);
      fy[c] = area[c] * (along * ny - tangent * uy);
      fz[c] = area[c] * (along * nz - tangent * uz);
    }
  }
}

template <class T>
void SheetForces<T>::begin() {
  strain({});
  for (StrainPlanes<T>* s : {&uu, &vv, &uv}) std::fill(s->lag.begin(), s->lag.end(), T(0));
  for (size_t k = 0; k < 3; ++k) {
    std::fill(lagging_[k].begin(), lagging_[k].end(), T(0));
    before_[k] = x[k];
  }
}

template <>
SELVEDGE_CLONES void SheetForces<float>::strain(const SheetLaw& law) {
  strain_here(law);
}
template <>
SELVEDGE_CLONES void SheetForces<double>::strain(const SheetLaw& law) {
  strain_here(law);
}
template <>
SELVEDGE_CLONES void SheetForces<float>::pull(const SheetLaw& law) {
  pull_here(law);
}
template <>
SELVEDGE_CLONES void SheetForces<double>::pull(const SheetLaw& law) {
  pull_here(law);
}
template <>
SELVEDGE_CLONES void SheetForces<float>::drag(const SheetLaw& law, SheetField<float>& out) {
  drag_here(law, out);
}
template <>
SELVEDGE_CLONES void SheetForces<double>::drag(const SheetLaw& law, SheetField<double>& out) {
  drag_here(law, out);
}

template <class T>
typename SheetForces<T>::Elastic SheetForces<T>::elastic(const SheetLaw& law) {
  strain(law);
  Elastic e;
  const auto sum = [&](const StrainPlanes<T>& s, const SheetPlane<T>& weight, double stiffness, double& to) {
    for (size_t i = 0; i < weight.size(); ++i)
      to += 0.5 * stiffness * static_cast<double>(weight[i]) * static_cast<double>(s.strain[i] * s.strain[i]);
  };
  sum(uu, weights_[0], law.stretch.stiffness, e.stretch);
  sum(vv, weights_[1], law.stretch.stiffness, e.stretch);
  sum(uv, weights_[2], law.shear.stiffness, e.shear);
  const auto square = [](double value) { return value * value; };
  for (const SheetPlane<T>& plane : x) {
    const auto at = [&](int r, int c) { return static_cast<double>(plane[grid_.at(r, c)]); };
    const auto slope_v = [&](int r, int c) {
      return grid_.v.middle_scale[static_cast<size_t>(r)] *
             (27 * (at(r + 1, c) - at(r, c)) - (at(r + 2, c) - at(r - 1, c))) / 24;
    };
    for (int r = 0; r < grid_.rows; ++r)
      for (int c = 0; c < grid_.columns; ++c) {
        double along = 0, down = 0;
        for (int k = 0; k < 5; ++k) {
          along += grid_.u.second[static_cast<size_t>(k)][static_cast<size_t>(c)] * at(r, c + k - 2);
          down += grid_.v.second[static_cast<size_t>(k)][static_cast<size_t>(r)] * at(r + k - 2, c);
        }
        e.bend += 0.5 * law.bend.stiffness * static_cast<double>(weights_[3][grid_.at(r, c)]) *
                  (square(along) + square(down));
        if (r + 1 == grid_.rows || c + 1 == grid_.columns) continue;
        const double twist = grid_.u.middle_scale[static_cast<size_t>(c)] *
                             (27 * (slope_v(r, c + 1) - slope_v(r, c)) - (slope_v(r, c + 2) - slope_v(r, c - 1))) / 24;
        e.bend += law.bend.stiffness * static_cast<double>(weights_[2][grid_.at(r, c)]) * square(twist);
      }
  }
  return e;
}

template class SheetForces<float>;
template class SheetForces<double>;

}  // namespace selvedge::hardware_sim
