// A number, or several numbers in SIMD lanes that go through the same arithmetic.
//
// Kernels are templates over the number type R: double for one run, Lanes4 for four runs of one experiment
// with four parameter sets. Every lane goes through the operations of a single run in the same order, so
// its bits are the same (fused multiply-add is switched off for the whole project).
#pragma once

#include <cmath>

namespace selvedge::cloth::kernel {

// Four doubles; GCC and Clang map the operators to vector instructions where there are any.
using Lanes4 = double __attribute__((vector_size(32)));

template <class R>
inline constexpr int lanes_of = sizeof(R) / sizeof(double);

inline double square_root(double x) { return std::sqrt(x); }
inline Lanes4 square_root(Lanes4 x) {
  return Lanes4{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
}

// The same value in every lane.
template <class R>
inline R broadcast(double x) {
  return R{} + x;
}

inline double lane(double x, int) { return x; }
inline double lane(const Lanes4& x, int i) { return x[i]; }
inline void set_lane(double& x, int, double value) { x = value; }
inline void set_lane(Lanes4& x, int i, double value) { x[i] = value; }

template <class R>
inline R absolute(R x) {
  return x < 0.0 ? -x : x;
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
  Vec3& operator+=(const Vec3& a) { x += a.x; y += a.y; z += a.z; return *this; }
  Vec3& operator-=(const Vec3& a) { x -= a.x; y -= a.y; z -= a.z; return *this; }
};

// A lane-wide vector scaled by one plain number.
template <class R>
inline Vec3<R> scaled(double s, const Vec3<R>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class R>
inline R dot(const Vec3<R>& a, const Vec3<R>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class R>
inline Vec3<R> cross(const Vec3<R>& a, const Vec3<R>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class R>
inline R norm(const Vec3<R>& a) {
  return square_root(dot(a, a));
}

}  // namespace selvedge::cloth::kernel
