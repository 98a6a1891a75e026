// Vectors of lanes and their arithmetic, once for each kind of processor (SELVEDGE_KIND names the namespace).
#pragma once

// For who looks at a header alone; the kinds set their own (kernels_of_kind.h).
#ifndef SELVEDGE_KIND
#define SELVEDGE_KIND kind_alone
#define SELVEDGE_WIDTH 16
#define SELVEDGE_KERNELS alone_kernels
#define SELVEDGE_BANDED alone_banded
#endif

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND {

template <class T, int L>
struct PackOf {
  typedef T Type __attribute__((vector_size(L * sizeof(T)), may_alias));
};
template <class T, int L>
using Pack = typename PackOf<T, L>::Type;

// x in every lane. Less nothing is x whatever its sign, so that it is copied and nothing is reckoned.
template <class V, class T>
inline V same(T x) {
  return x - V{};
}

// a b + c, rounded once where the processor has it: the compiler may not fuse on its own.
#ifdef __AVX2__
inline Pack<float, 4> fused(Pack<float, 4> a, Pack<float, 4> b, Pack<float, 4> c) { return _mm_fmadd_ps(a, b, c); }
inline Pack<float, 8> fused(Pack<float, 8> a, Pack<float, 8> b, Pack<float, 8> c) { return _mm256_fmadd_ps(a, b, c); }
inline Pack<double, 2> fused(Pack<double, 2> a, Pack<double, 2> b, Pack<double, 2> c) { return _mm_fmadd_pd(a, b, c); }
inline Pack<double, 4> fused(Pack<double, 4> a, Pack<double, 4> b, Pack<double, 4> c) {
  return _mm256_fmadd_pd(a, b, c);
}
inline Pack<float, 8> root(Pack<float, 8> a) { return _mm256_sqrt_ps(a); }
inline Pack<double, 4> root(Pack<double, 4> a) { return _mm256_sqrt_pd(a); }
#else
template <class V>
inline V fused(V a, V b, V c) {
  return a * b + c;
}
#endif
#ifdef __AVX512F__
inline Pack<float, 16> fused(Pack<float, 16> a, Pack<float, 16> b, Pack<float, 16> c) {
  return _mm512_fmadd_ps(a, b, c);
}
inline Pack<double, 8> fused(Pack<double, 8> a, Pack<double, 8> b, Pack<double, 8> c) {
  return _mm512_fmadd_pd(a, b, c);
}
inline Pack<float, 16> root(Pack<float, 16> a) { return _mm512_maskz_sqrt_ps(0xffff, a); }
inline Pack<double, 8> root(Pack<double, 8> a) { return _mm512_maskz_sqrt_pd(0xff, a); }
#endif
// Every x86-64 has these two.
inline Pack<float, 4> root(Pack<float, 4> a) { return __builtin_ia32_sqrtps(a); }
inline Pack<double, 2> root(Pack<double, 2> a) { return __builtin_ia32_sqrtpd(a); }

template <class V>
inline V absolute(V a) {
  return a < 0 ? -a : a;
}

template <class V>
struct Vec3 {
  V x, y, z;
};
template <class V>
inline V dot(const Vec3<V>& a, const Vec3<V>& b) {
  return fused(a.z, b.z, fused(a.y, b.y, a.x * b.x));
}
template <class V>
inline Vec3<V> cross(const Vec3<V>& a, const Vec3<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class V>
inline Vec3<V> operator*(const V& s, const Vec3<V>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class V>
inline Vec3<V> operator-(const Vec3<V>& a, const Vec3<V>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
// s a + b.
template <class V>
inline Vec3<V> add_scaled(const V& s, const Vec3<V>& a, const Vec3<V>& b) {
  return {fused(s, a.x, b.x), fused(s, a.y, b.y), fused(s, a.z, b.z)};
}

}  // namespace selvedge::cloth::spline::kernel::SELVEDGE_KIND
