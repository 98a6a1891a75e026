// A number, or several numbers in SIMD lanes that go through the same arithmetic.
//
// Runs of one experiment with four parameter sets, or eight where the processor has AVX-512, go through Lanes4 or
// Lanes8, vertex vectors being Vec3 of these. A single run keeps each vertex in a Quad (x, y, z, 0) and takes its
// triangles as many at a time. Either way a run goes through the same operations in the same order, so its bits are the
// same: the compiler may not fuse multiply and add on its own, fused() says where it happens, in all.
#pragma once

#include <cmath>
#include <type_traits>

#ifdef __AVX__
#include <immintrin.h>
#endif

namespace selvedge::cloth::kernel {

// Four doubles; GCC and Clang map the operators to vector instructions where there are any.
using Lanes4 = double __attribute__((vector_size(32)));

#ifdef __AVX512F__
using Lanes8 = double __attribute__((vector_size(64)));
using WidestLanes = Lanes8;
#else
using WidestLanes = Lanes4;
#endif

template <class R>
inline constexpr int lanes_of = sizeof(R) / sizeof(double);

inline double square_root(double x) { return std::sqrt(x); }
inline Lanes4 square_root(Lanes4 x) {
#ifdef __AVX__
  return _mm256_sqrt_pd(x);  // correctly rounded, as std::sqrt is
#else
  return Lanes4{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
#endif
}

#ifdef __AVX512F__
inline Lanes8 square_root(Lanes8 x) { return _mm512_maskz_sqrt_pd(0xff, x); }
#endif

// a b + c, rounded once where the instruction set has it.
inline double fused(double a, double b, double c) {
#ifdef __FMA__
  return __builtin_fma(a, b, c);
#else
  return a * b + c;
#endif
}
inline Lanes4 fused(Lanes4 a, Lanes4 b, Lanes4 c) {
#ifdef __FMA__
  return _mm256_fmadd_pd(a, b, c);
#else
  return a * b + c;
#endif
}
inline Lanes4 fused(double a, Lanes4 b, Lanes4 c) { return fused(Lanes4{a, a, a, a}, b, c); }
#ifdef __AVX512F__
inline Lanes8 fused(Lanes8 a, Lanes8 b, Lanes8 c) { return _mm512_fmadd_pd(a, b, c); }
inline Lanes8 fused(double a, Lanes8 b, Lanes8 c) { return fused(Lanes8{} + a, b, c); }
#endif

// The same value in every lane.
template <class R>
inline R broadcast(double x) {
  return R{} + x;
}

inline double lane(double x, int) { return x; }
inline void set_lane(double& x, int, double value) { x = value; }
template <class R>
inline double lane(const R& x, int i) {
  return x[i];
}
template <class R>
inline void set_lane(R& x, int i, double value) {
  x[i] = value;
}

template <class R>
inline R absolute(R x) {
  return x < 0.0 ? -x : x;
}

// e^x, lane by lane.
template <class R>
inline R exponential(R x) {
  for (int i = 0; i < lanes_of<R>; ++i) set_lane(x, i, std::exp(lane(x, i)));
  return x;
}

template <class R>
inline R larger(R x, R y) {
  return x > y ? x : y;
}

template <class R>
struct Vec3 {
  R x, y, z;
  friend Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vec3 operator*(const R& s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
  Vec3& operator+=(const Vec3& a) {
    x += a.x;
    y += a.y;
    z += a.z;
    return *this;
  }
  Vec3& operator-=(const Vec3& a) {
    x -= a.x;
    y -= a.y;
    z -= a.z;
    return *this;
  }
};

// Scaled by one plain number, or by one a lane.
template <class G, class R>
inline Vec3<R> scaled(const G& s, const Vec3<R>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class R>
inline R dot(const Vec3<R>& a, const Vec3<R>& b) {
  return fused(a.z, b.z, fused(a.y, b.y, a.x * b.x));
}
// s a + b.
template <class G, class R>
inline Vec3<R> add_scaled(const G& s, const Vec3<R>& a, const Vec3<R>& b) {
  return {fused(s, a.x, b.x), fused(s, a.y, b.y), fused(s, a.z, b.z)};
}
template <class R>
inline Vec3<R> cross(const Vec3<R>& a, const Vec3<R>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class R>
inline R norm(const Vec3<R>& a) {
  return square_root(dot(a, a));
}

// One vertex of a single run; the fourth entry stays zero.
struct Quad {
  Lanes4 q;
  friend Quad operator+(const Quad& a, const Quad& b) { return {a.q + b.q}; }
  friend Quad operator-(const Quad& a, const Quad& b) { return {a.q - b.q}; }
  friend Quad operator*(double s, const Quad& a) { return {s * a.q}; }
  Quad& operator+=(const Quad& a) {
    q += a.q;
    return *this;
  }
  Quad& operator-=(const Quad& a) {
    q -= a.q;
    return *this;
  }
};
inline Quad scaled(double s, const Quad& a) { return {s * a.q}; }
inline Quad add_scaled(double s, const Quad& a, const Quad& b) { return {fused(s, a.q, b.q)}; }
inline double dot(const Quad& a, const Quad& b) {
  return fused(a.q[2], b.q[2], fused(a.q[1], b.q[1], a.q[0] * b.q[0]));
}
inline Quad cross(const Quad& a, const Quad& b) {
  return {Lanes4{a.q[1] * b.q[2] - a.q[2] * b.q[1], a.q[2] * b.q[0] - a.q[0] * b.q[2],
                 a.q[0] * b.q[1] - a.q[1] * b.q[0], 0}};
}
inline double norm(const Quad& a) { return std::sqrt(dot(a, a)); }

// What goes with a vertex vector V: its scalar, the numbers in which its triangles are reckoned, and how many runs it
// holds.
template <class V>
struct Kind;
template <class R>
struct Kind<Vec3<R>> {
  using Scalar = R;
  using Triangles = R;
  static constexpr int runs = lanes_of<R>;
};
template <>
struct Kind<Quad> {
  using Scalar = double;
  using Triangles = Lanes4;  // eight at a time take longer: gathering them costs more than it saves
  static constexpr int runs = 1;
};
template <class V>
using ScalarOf = typename Kind<V>::Scalar;
template <class V>
using TrianglesOf = typename Kind<V>::Triangles;
template <class R>
using VertexVectorOf = std::conditional_t<std::is_same_v<R, double>, Quad, Vec3<R>>;

template <class R>
inline void set_run(Vec3<R>& v, int run, double x, double y, double z) {
  v.x[run] = x;
  v.y[run] = y;
  v.z[run] = z;
}
inline void set_run(Quad& v, int, double x, double y, double z) { v.q = Lanes4{x, y, z, 0}; }
template <class R>
inline void store_run(const Vec3<R>& v, int run, double* to) {
  to[0] = v.x[run];
  to[1] = v.y[run];
  to[2] = v.z[run];
}
inline void store_run(const Quad& v, int, double* to) {
  to[0] = v.q[0];
  to[1] = v.q[1];
  to[2] = v.q[2];
}

// Four Quads as the lanes of one Vec3, and back.
inline Vec3<Lanes4> lanes_of_quads(const Quad& a, const Quad& b, const Quad& c, const Quad& d) {
  const Lanes4 ab_low = __builtin_shufflevector(a.q, b.q, 0, 4, 2, 6),
               ab_high = __builtin_shufflevector(a.q, b.q, 1, 5, 3, 7);
  const Lanes4 cd_low = __builtin_shufflevector(c.q, d.q, 0, 4, 2, 6),
               cd_high = __builtin_shufflevector(c.q, d.q, 1, 5, 3, 7);
  return {__builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5), __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5),
          __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7)};
}
inline void quads_of_lanes(const Vec3<Lanes4>& v, Quad out[4]) {
  const Lanes4 zero{};
  const Lanes4 xy_even = __builtin_shufflevector(v.x, v.y, 0, 4, 2, 6),
               xy_odd = __builtin_shufflevector(v.x, v.y, 1, 5, 3, 7);
  const Lanes4 z_even = __builtin_shufflevector(v.z, zero, 0, 4, 2, 6),
               z_odd = __builtin_shufflevector(v.z, zero, 1, 5, 3, 7);
  out[0].q = __builtin_shufflevector(xy_even, z_even, 0, 1, 4, 5);
  out[1].q = __builtin_shufflevector(xy_odd, z_odd, 0, 1, 4, 5);
  out[2].q = __builtin_shufflevector(xy_even, z_even, 2, 3, 6, 7);
  out[3].q = __builtin_shufflevector(xy_odd, z_odd, 2, 3, 6, 7);
}

}  // namespace selvedge::cloth::kernel
