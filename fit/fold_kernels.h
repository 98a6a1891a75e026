// The inner loops of the fold metric, over one row at a time, compiled once for plain x86-64 and once for AVX2.
// Symmetric and antisymmetric filters share their sums: s = right + left, d = right − left.
// Filters, in this order everywhere: g0 = e, g1 = t e, g2 = (2t² − 1) e, h2 = (t² − 0.7515) e,
// h3 = (t³ − 2.254 t) e with e = exp(−t²); the constants of Freeman & Adelson's tables enter in `coefficients`.
#pragma once

#include <cstddef>

namespace selvedge::fit::kernels {

inline constexpr int kFilters = 5;
enum Filter { g0, g1, g2, h2, h3 };

// out[f · stride + x] = Σ_k filter_f(k) · in[x + radius + k] for the five filters. taps: filter f, distance k
// from the centre at f · (radius + 1) + k.
void filter_row(const float* in, int width, const float* taps, int radius, float* out, size_t stride);

// From 2 · radius + 1 filtered rows (rows[j] as filter_row left them) the row of C2 and C3.
void coefficients(const float* const* rows, size_t stride, int width, const float* taps, int radius, float* c2,
                  float* c3);

// Symmetric smoothing along a row: out[x] = Σ_k taps[|k|] · in[x + radius + k].
void smooth_row(const float* in, int width, const float* taps, int radius, float* out);

// The same across rows, for C2 and C3 at once, and then θ = ½ arg(C2, C3).
void smooth_columns_to_angle(const float* const* c2_rows, const float* const* c3_rows, int width, const float* taps,
                             int radius, float* angle);

// |∇θ| by central differences wrapped mod π; 0 unless the pixel and its four neighbours are inside.
void gradient_row(const float* above, const float* here, const float* below, const unsigned char* inside_above,
                  const unsigned char* inside_here, const unsigned char* inside_below, int width, float* out);

}  // namespace selvedge::fit::kernels
