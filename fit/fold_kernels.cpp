#include "fit/fold_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

// Two versions of each loop, chosen at load time. Sanitizers start before such a choice can be made.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SELVEDGE_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define SELVEDGE_CLONES
#endif

namespace selvedge::fit::kernels {

namespace {

// The bodies are unrolled for the one radius that is used by default; that is what lets them be vectorised
// over x.
#define SELVEDGE_BODY __attribute__((always_inline)) inline
constexpr int kUsualRadius = 6;

SELVEDGE_BODY void filter_row_body(const float* __restrict in, int width, const float* __restrict taps, int radius,
                                   float* __restrict out, size_t stride) {
  float* o0 = out + g0 * stride;
  float* o1 = out + g1 * stride;
  float* o2 = out + g2 * stride;
  float* o3 = out + h2 * stride;
  float* o4 = out + h3 * stride;
  const int n = radius + 1;
  for (int x = 0; x < width; ++x) {
    const float centre = in[x + radius];
    float a0 = taps[g0 * n] * centre, a1 = 0, a2 = taps[g2 * n] * centre, a3 = taps[h2 * n] * centre, a4 = 0;
#pragma GCC unroll 8
    for (int k = 1; k <= radius; ++k) {
      const float right = in[x + radius + k], left = in[x + radius - k];
      const float s = right + left, d = right - left;
      a0 += taps[g0 * n + k] * s;
      a1 += taps[g1 * n + k] * d;
      a2 += taps[g2 * n + k] * s;
      a3 += taps[h2 * n + k] * s;
      a4 += taps[h3 * n + k] * d;
    }
    o0[x] = a0;
    o1[x] = a1;
    o2[x] = a2;
    o3[x] = a3;
    o4[x] = a4;
  }
}

SELVEDGE_BODY void coefficients_body(const float* const* rows, size_t stride, int width, const float* __restrict taps,
                                     int radius, float* __restrict c2, float* __restrict c3) {
  const int n = radius + 1;
  for (int x = 0; x < width; ++x) {
    const float* mid = rows[radius] + x;
    float g2a = taps[g0 * n] * mid[g2 * stride], g2b = 0, g2c = taps[g2 * n] * mid[g0 * stride];
    float h2a = taps[g0 * n] * mid[h3 * stride], h2b = 0, h2c = taps[h2 * n] * mid[g1 * stride], h2d = 0;
#pragma GCC unroll 8
    for (int k = 1; k <= radius; ++k) {
      const float* lower = rows[radius + k] + x;
      const float* upper = rows[radius - k] + x;
      g2a += taps[g0 * n + k] * (lower[g2 * stride] + upper[g2 * stride]);
      g2b += taps[g1 * n + k] * (lower[g1 * stride] - upper[g1 * stride]);
      g2c += taps[g2 * n + k] * (lower[g0 * stride] + upper[g0 * stride]);
      h2a += taps[g0 * n + k] * (lower[h3 * stride] + upper[h3 * stride]);
      h2b += taps[g1 * n + k] * (lower[h2 * stride] - upper[h2 * stride]);
      h2c += taps[h2 * n + k] * (lower[g1 * stride] + upper[g1 * stride]);
      h2d += taps[h3 * n + k] * (lower[g0 * stride] - upper[g0 * stride]);
    }
    // Tables III and V.
    g2a *= 0.9213f;
    g2b *= 1.843f;
    g2c *= 0.9213f;
    h2a *= 0.9780f;
    h2b *= 0.9780f;
    h2c *= 0.9780f;
    h2d *= 0.9780f;
    // Appendix I.
    c2[x] = 0.5f * (g2a * g2a - g2c * g2c) + 0.46875f * (h2a * h2a - h2d * h2d) + 0.28125f * (h2b * h2b - h2c * h2c) +
            0.1875f * (h2a * h2c - h2b * h2d);
    c3[x] = -g2a * g2b - g2b * g2c - 0.9375f * (h2c * h2d + h2a * h2b) - 1.6875f * h2b * h2c - 0.1875f * h2a * h2d;
  }
}

SELVEDGE_BODY void smooth_row_body(const float* __restrict in, int width, const float* __restrict taps, int radius,
                                   float* __restrict out) {
  for (int x = 0; x < width; ++x) {
    float sum = taps[0] * in[x + radius];
#pragma GCC unroll 8
    for (int k = 1; k <= radius; ++k) sum += taps[k] * (in[x + radius + k] + in[x + radius - k]);
    out[x] = sum;
  }
}

SELVEDGE_BODY void smooth_columns_to_angle_body(const float* const* c2_rows, const float* const* c3_rows, int width,
                                                const float* __restrict taps, int radius, float* __restrict angle) {
  constexpr float pi = std::numbers::pi_v<float>;
  for (int x = 0; x < width; ++x) {
    float c2 = taps[0] * c2_rows[radius][x], c3 = taps[0] * c3_rows[radius][x];
#pragma GCC unroll 8
    for (int k = 1; k <= radius; ++k) {
      c2 += taps[k] * (c2_rows[radius + k][x] + c2_rows[radius - k][x]);
      c3 += taps[k] * (c3_rows[radius + k][x] + c3_rows[radius - k][x]);
    }
    // arg(c2, c3) by a minimax polynomial of the arctangent on [0, 1], absolute error below 2e-5 rad.
    const float ax = std::fabs(c2), ay = std::fabs(c3);
    const float low = ax < ay ? ax : ay, high = ax < ay ? ay : ax;
    const float z = low / (high + 1e-30f), zz = z * z;
    float a =
        z * (0.99997726f +
             zz * (-0.33262347f + zz * (0.19354346f + zz * (-0.11643287f + zz * (0.05265332f - zz * 0.01172120f)))));
    a = ay > ax ? 0.5f * pi - a : a;
    a = c2 < 0 ? pi - a : a;
    a = c3 < 0 ? -a : a;
    angle[x] = 0.5f * a;
  }
}

}  // namespace

SELVEDGE_CLONES
void filter_row(const float* in, int width, const float* taps, int radius, float* out, size_t stride) {
  if (radius == kUsualRadius) filter_row_body(in, width, taps, kUsualRadius, out, stride);
  else filter_row_body(in, width, taps, radius, out, stride);
}

SELVEDGE_CLONES
void coefficients(const float* const* rows, size_t stride, int width, const float* taps, int radius, float* c2,
                  float* c3) {
  if (radius == kUsualRadius) coefficients_body(rows, stride, width, taps, kUsualRadius, c2, c3);
  else coefficients_body(rows, stride, width, taps, radius, c2, c3);
}

SELVEDGE_CLONES
void smooth_row(const float* in, int width, const float* taps, int radius, float* out) {
  if (radius == kUsualRadius) smooth_row_body(in, width, taps, kUsualRadius, out);
  else smooth_row_body(in, width, taps, radius, out);
}

SELVEDGE_CLONES
void smooth_columns_to_angle(const float* const* c2_rows, const float* const* c3_rows, int width, const float* taps,
                             int radius, float* angle) {
  if (radius == kUsualRadius) smooth_columns_to_angle_body(c2_rows, c3_rows, width, taps, kUsualRadius, angle);
  else smooth_columns_to_angle_body(c2_rows, c3_rows, width, taps, radius, angle);
}

SELVEDGE_CLONES
void gradient_row(const float* above, const float* here, const float* below, const unsigned char* inside_above,
                  const unsigned char* inside_here, const unsigned char* inside_below, int width,
                  float* __restrict out) {
  constexpr float pi = std::numbers::pi_v<float>;
  for (int x = 1; x + 1 < width; ++x) {
    float dx = here[x + 1] - here[x - 1], dy = below[x] - above[x];
    dx = dx > 0.5f * pi ? dx - pi : dx;
    dx = dx < -0.5f * pi ? dx + pi : dx;
    dy = dy > 0.5f * pi ? dy - pi : dy;
    dy = dy < -0.5f * pi ? dy + pi : dy;
    const int whole = inside_here[x] & inside_here[x - 1] & inside_here[x + 1] & inside_above[x] & inside_below[x];
    out[x] = 0.5f * std::sqrt(dx * dx + dy * dy) * float(whole);
  }
}

}  // namespace selvedge::fit::kernels
