#include "hardware_sim/sheets/point_fields.h"

#include <algorithm>
#include <cmath>
#include <utility>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SELVEDGE_CLONES __attribute__((target_clones("arch=haswell", "default")))
#else
#define SELVEDGE_CLONES
#endif

namespace selvedge::hardware_sim {

namespace {

SELVEDGE_CLONES void combine_six(const LineRows& rows, const float* in, float* out, int n) {
  for (int p = 0; p < rows.rows; ++p) {
    const float* w = &rows.weight[static_cast<size_t>(p) * 6];
    const float* r = in + static_cast<size_t>(rows.first[static_cast<size_t>(p)]) * static_cast<size_t>(n);
    const float *r0 = r, *r1 = r + n, *r2 = r + 2 * n, *r3 = r + 3 * n, *r4 = r + 4 * n, *r5 = r + 5 * n;
    const float w0 = w[0], w1 = w[1], w2 = w[2], w3 = w[3], w4 = w[4], w5 = w[5];
    float* __restrict o = out + static_cast<size_t>(p) * static_cast<size_t>(n);
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) o[i] = w0 * r0[i] + w1 * r1[i] + w2 * r2[i] + w3 * r3[i] + w4 * r4[i] + w5 * r5[i];
  }
}

SELVEDGE_CLONES void hand_back_six(const LineRows& rows, const float* out, float* in, int n) {
  for (int p = 0; p < rows.rows; ++p) {
    const float* w = &rows.weight[static_cast<size_t>(p) * 6];
    float* r = in + static_cast<size_t>(rows.first[static_cast<size_t>(p)]) * static_cast<size_t>(n);
    float *r0 = r, *r1 = r + n, *r2 = r + 2 * n, *r3 = r + 3 * n, *r4 = r + 4 * n, *r5 = r + 5 * n;
    const float w0 = w[0], w1 = w[1], w2 = w[2], w3 = w[3], w4 = w[4], w5 = w[5];
    const float* o = out + static_cast<size_t>(p) * static_cast<size_t>(n);
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) {
      const float f = o[i];
      r0[i] += w0 * f;
      r1[i] += w1 * f;
      r2[i] += w2 * f;
      r3[i] += w3 * f;
      r4[i] += w4 * f;
      r5[i] += w5 * f;
    }
  }
}

SELVEDGE_CLONES void stretch_row(StrainMeasure measure, const float* p0, const float* p1, const float* p2,
                                 float* __restrict strain, int n) {
  if (measure == StrainMeasure::biot) {
#pragma GCC ivdep
    for (int i = 0; i < n; ++i) strain[i] = std::sqrt(p0[i] * p0[i] + p1[i] * p1[i] + p2[i] * p2[i]) - 1.0f;
    return;
  }
  // ½ ln y = artanh z, z = (y − 1) / (y + 1).
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float y = p0[i] * p0[i] + p1[i] * p1[i] + p2[i] * p2[i];
    const float z = (y - 1.0f) / (y + 1.0f), q = z * z;
    strain[i] = z * (1.0f + q * (1.0f / 3 + q * (1.0f / 5 + q * (1.0f / 7 + q * (1.0f / 9)))));
  }
}

SELVEDGE_CLONES void shear_row(StrainMeasure measure, const float* a0, const float* a1, const float* a2,
                               const float* b0, const float* b1, const float* b2, float* __restrict strain, int n) {
  const float to_tangent = measure == StrainMeasure::hencky ? 1.0f : 0.0f;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float aa = a0[i] * a0[i] + a1[i] * a1[i] + a2[i] * a2[i], bb = b0[i] * b0[i] + b1[i] * b1[i] + b2[i] * b2[i],
                ab = a0[i] * b0[i] + a1[i] * b1[i] + a2[i] * b2[i];
    const float sine = ab / std::sqrt(aa * bb), square = std::min(sine * sine, 0.9f);
    strain[i] = sine / std::sqrt(1.0f - to_tangent * square);
  }
}

// s ∂E/∂a = s 2 E'(y) a.
SELVEDGE_CLONES void pull_row(StrainMeasure measure, const float* a0, const float* a1, const float* a2, const float* b0,
                              const float* b1, const float* b2, const float* along, const float* down,
                              const float* shear, const float* weight, float* __restrict fa0, float* __restrict fa1,
                              float* __restrict fa2, float* __restrict fb0, float* __restrict fb1,
                              float* __restrict fb2, int n) {
  const float is_log = measure == StrainMeasure::hencky ? 1.0f : 0.0f;
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) {
    const float aa = a0[i] * a0[i] + a1[i] * a1[i] + a2[i] * a2[i], bb = b0[i] * b0[i] + b1[i] * b1[i] + b2[i] * b2[i],
                ab = a0[i] * b0[i] + a1[i] * b1[i] + a2[i] * b2[i];
    const float ra = 1.0f / std::sqrt(aa), rb = 1.0f / std::sqrt(bb);
    const float sine = ab * ra * rb, square = std::min(sine * sine, 0.9f);
    const float cosine = std::sqrt(1.0f - is_log * square);
    const float s = weight[i] * shear[i] / (cosine * cosine * cosine);
    const float per_a = is_log * ra * ra + (1.0f - is_log) * ra, per_b = is_log * rb * rb + (1.0f - is_log) * rb;
    const float ka = weight[i] * along[i] * per_a - s * sine * ra * ra,
                kb = weight[i] * down[i] * per_b - s * sine * rb * rb, kab = s * ra * rb;
    fa0[i] = ka * a0[i] + kab * b0[i];
    fa1[i] = ka * a1[i] + kab * b1[i];
    fa2[i] = ka * a2[i] + kab * b2[i];
    fb0[i] = kb * b0[i] + kab * a0[i];
    fb1[i] = kb * b1[i] + kab * a1[i];
    fb2[i] = kb * b2[i] + kab * a2[i];
  }
}

SELVEDGE_CLONES void weigh_row(const float* in, const float* weight, float times, float* __restrict out, int n) {
#pragma GCC ivdep
  for (int i = 0; i < n; ++i) out[i] = times * weight[i] * in[i];
}

std::vector<float> floats(const std::vector<double>& in) { return {in.begin(), in.end()}; }

size_t times(int a, int b) { return static_cast<size_t>(a) * static_cast<size_t>(b); }

}  // namespace

void combine(const LineRows& rows, const float* in, float* out, int n) {
  if (rows.reach == 6) return combine_six(rows, in, out, n);
  for (int p = 0; p < rows.rows; ++p) {
    float* o = out + times(p, n);
    std::fill(o, o + n, 0.0f);
    for (int k = 0; k < rows.reach; ++k) {
      const float w = rows.weight[times(p, rows.reach) + static_cast<size_t>(k)];
      const float* r = in + times(rows.first[static_cast<size_t>(p)] + k, n);
      for (int i = 0; i < n; ++i) o[i] += w * r[i];
    }
  }
}

void hand_back(const LineRows& rows, const float* out, float* in, int n) {
  if (rows.reach == 6) return hand_back_six(rows, out, in, n);
  for (int p = 0; p < rows.rows; ++p) {
    const float* o = out + times(p, n);
    for (int k = 0; k < rows.reach; ++k) {
      const float w = rows.weight[times(p, rows.reach) + static_cast<size_t>(k)];
      float* r = in + times(rows.first[static_cast<size_t>(p)] + k, n);
      for (int i = 0; i < n; ++i) r[i] += w * o[i];
    }
  }
}

PointGrid::PointGrid(PointLine along_u, PointLine down_v)
    : u_(std::move(along_u)), v_(std::move(down_v)), weight_u_(floats(u_.point_weight)),
      weight_v_(floats(v_.point_weight)), penalty_u_(floats(u_.kink_penalty)), penalty_v_(floats(v_.kink_penalty)) {
  for (const double along : u_.point_weight)
    for (const double down : v_.point_weight) weight_.push_back(static_cast<float>(along * down));
}

PointFields PointGrid::make_fields() const {
  PointFields f;
  for (std::vector<float>* field : {&f.a, &f.b, &f.uu, &f.vv, &f.uv}) field->resize(3 * points());
  for (std::vector<float>* field : {&f.kink_u, &f.kink_u_bend}) field->resize(3 * times(u_.kink.rows, v_.points()));
  for (std::vector<float>* field : {&f.kink_v, &f.kink_v_bend}) field->resize(3 * times(u_.points(), v_.kink.rows));
  return f;
}

// [row][axis][node u] to [node u][axis][row], and back.
void PointGrid::to_columns(const std::vector<float>& down, int rows, std::vector<float>& out) const {
  const int n = columns();
  out.resize(3 * times(n, rows));
  for (int r = 0; r < rows; ++r)
    for (int a = 0; a < 3; ++a) {
      const float* from = &down[times(3 * r + a, n)];
      float* to = &out[times(a, rows) + static_cast<size_t>(r)];
      for (int c = 0; c < n; ++c) to[times(3 * c, rows)] = from[c];
    }
}

void PointGrid::to_rows(const std::vector<float>& columns_in, int rows, std::vector<float>& out) const {
  const int n = columns();
  out.resize(3 * times(n, rows));
  for (int r = 0; r < rows; ++r)
    for (int a = 0; a < 3; ++a) {
      float* to = &out[times(3 * r + a, n)];
      const float* from = &columns_in[times(a, rows) + static_cast<size_t>(r)];
      for (int c = 0; c < n; ++c) to[c] = from[times(3 * c, rows)];
    }
}

void PointGrid::look(const std::vector<float>& place, const std::vector<float>& bent, PointFields& out) {
  const int across = 3 * columns(), pv = v_.points(), kv = v_.kink.rows, wide = 3 * pv;
  const auto go_down = [&](size_t which, const LineRows& rows, const std::vector<float>& in) {
    down_[which].resize(times(rows.rows, across));
    combine(rows, in.data(), down_[which].data(), across);
    to_columns(down_[which], rows.rows, turned_[which]);
  };
  go_down(0, v_.value, place);
  go_down(1, v_.slope, place);
  go_down(2, v_.value, bent);
  go_down(3, v_.slope, bent);
  go_down(4, v_.second, bent);
  combine(u_.slope, turned_[0].data(), out.a.data(), wide);
  combine(u_.value, turned_[1].data(), out.b.data(), wide);
  combine(u_.second, turned_[2].data(), out.uu.data(), wide);
  combine(u_.slope, turned_[3].data(), out.uv.data(), wide);
  combine(u_.value, turned_[4].data(), out.vv.data(), wide);
  if (u_.kink.rows > 0) {
    combine(u_.kink, turned_[2].data(), out.kink_u.data(), wide);
    combine(u_.kink_bend, turned_[2].data(), out.kink_u_bend.data(), wide);
  }
  if (kv > 0) {
    go_down(5, v_.kink, bent);
    go_down(6, v_.kink_bend, bent);
    combine(u_.value, turned_[5].data(), out.kink_v.data(), 3 * kv);
    combine(u_.value, turned_[6].data(), out.kink_v_bend.data(), 3 * kv);
  }
}

void PointGrid::gather(const PointFields& pulls, std::vector<float>& force) {
  const int across = 3 * columns(), pv = v_.points(), kv = v_.kink.rows, wide = 3 * pv;
  const auto cleared = [&](size_t which, int rows) {
    turned_[which].assign(3 * times(columns(), rows), 0.0f);
    return turned_[which].data();
  };
  force.assign(3 * times(columns(), rows()), 0.0f);
  const auto go_up = [&](size_t which, const LineRows& rows) {
    to_rows(turned_[which], rows.rows, down_[which]);
    hand_back(rows, down_[which].data(), force.data(), across);
  };
  float* value = cleared(0, pv);
  hand_back(u_.slope, pulls.a.data(), value, wide);
  hand_back(u_.second, pulls.uu.data(), value, wide);
  if (u_.kink.rows > 0) {
    hand_back(u_.kink, pulls.kink_u.data(), value, wide);
    hand_back(u_.kink_bend, pulls.kink_u_bend.data(), value, wide);
  }
  float* slope = cleared(1, pv);
  hand_back(u_.value, pulls.b.data(), slope, wide);
  hand_back(u_.slope, pulls.uv.data(), slope, wide);
  hand_back(u_.value, pulls.vv.data(), cleared(2, pv), wide);
  go_up(0, v_.value);
  go_up(1, v_.slope);
  go_up(2, v_.second);
  if (kv > 0) {
    hand_back(u_.value, pulls.kink_v.data(), cleared(3, kv), 3 * kv);
    hand_back(u_.value, pulls.kink_v_bend.data(), cleared(4, kv), 3 * kv);
    go_up(3, v_.kink);
    go_up(4, v_.kink_bend);
  }
  for (float& f : force) f = -f;
}

void PointGrid::strain(StrainMeasure measure, const PointFields& at, PointStrain& along, PointStrain& down,
                       PointStrain& shear) const {
  const int n = v_.points();
  for (int p = 0; p < u_.points(); ++p) {
    const size_t row = times(p, n);
    const float *a = &at.a[3 * row], *b = &at.b[3 * row];
    stretch_row(measure, a, a + n, a + 2 * n, &along.strain[row], n);
    stretch_row(measure, b, b + n, b + 2 * n, &down.strain[row], n);
    shear_row(measure, a, a + n, a + 2 * n, b, b + n, b + 2 * n, &shear.strain[row], n);
  }
}

void PointGrid::pull(StrainMeasure measure, const PointFields& at, const PointStrain& along, const PointStrain& down,
                     const PointStrain& shear, PointFields& pulls) const {
  const int n = v_.points();
  for (int p = 0; p < u_.points(); ++p) {
    const size_t row = times(p, n);
    const float *a = &at.a[3 * row], *b = &at.b[3 * row];
    float *fa = &pulls.a[3 * row], *fb = &pulls.b[3 * row];
    pull_row(measure, a, a + n, a + 2 * n, b, b + n, b + 2 * n, &along.stress[row], &down.stress[row],
             &shear.stress[row], &weight_[row], fa, fa + n, fa + 2 * n, fb, fb + n, fb + 2 * n, n);
  }
}

void PointGrid::bend(const PointFields& at, PointFields& pulls) const {
  const int n = v_.points(), kv = v_.kink.rows;
  for (int p = 0; p < u_.points(); ++p)
    for (int axis = 0; axis < 3; ++axis) {
      const size_t row = times(3 * p + axis, n);
      const float* weight = &weight_[times(p, n)];
      weigh_row(&at.uu[row], weight, 1, &pulls.uu[row], n);
      weigh_row(&at.vv[row], weight, 1, &pulls.vv[row], n);
      weigh_row(&at.uv[row], weight, 2, &pulls.uv[row], n);
      for (int k = 0; k < kv; ++k) {
        const size_t i = times(3 * p + axis, kv) + static_cast<size_t>(k);
        const float w = weight_u_[static_cast<size_t>(p)];
        pulls.kink_v[i] = w * (at.kink_v_bend[i] + penalty_v_[static_cast<size_t>(k)] * at.kink_v[i]);
        pulls.kink_v_bend[i] = w * at.kink_v[i];
      }
    }
  for (int k = 0; k < u_.kink.rows; ++k)
    for (int axis = 0; axis < 3; ++axis)
      for (int q = 0; q < n; ++q) {
        const size_t i = times(3 * k + axis, n) + static_cast<size_t>(q);
        const float w = weight_v_[static_cast<size_t>(q)];
        pulls.kink_u[i] = w * (at.kink_u_bend[i] + penalty_u_[static_cast<size_t>(k)] * at.kink_u[i]);
        pulls.kink_u_bend[i] = w * at.kink_u[i];
      }
}

}  // namespace selvedge::hardware_sim
