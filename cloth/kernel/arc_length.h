// Sides of triangles are chords: of fabric that is bent along a side, more lies between its ends than their distance.
//
// A side d (flat, m) of a curve with second derivative c = x'' along it, taken once over the side (c = d·H·d, m), has
// |Δx|² = l² − |c|²/12 + O(l⁶) where the fabric between is l long. The metric that adds |c|²/12 to the squares of a
// triangle's three sides is added to its strains, with H the mean over its corners:
//   ε_u += ½ δ_uu,  s += δ_uv,  ε_v += ½ δ_vv.
// Without it a sheet of spacing h under tension T bends as if its rigidity were T h²/12 less: a third at
// 25 mm for a soft swatch under its own weight (docs/decisions/0010). δ is quadratic in the positions
// and its force the exact derivative of the energy, so that nothing is damped or fed.
#pragma once

#include "cloth/kernel/bending.h"

namespace selvedge::cloth::kernel {

// Six numbers a vertex: the products of its second derivatives, or what pulls at them.
template <class V>
struct SixOf {
  V first, second;  // uu·uu, uu·uv, uu·vv; uv·uv, uv·vv, vv·vv
};
template <class R>
inline Vec3<R> three(const R& a, const R& b, const R& c, const Vec3<R>*) {
  return {a, b, c};
}
inline Quad three(double a, double b, double c, const Quad*) { return {Lanes4{a, b, c, 0}}; }
template <class R>
inline Vec3<R> parts(const Vec3<R>& v) {
  return v;
}
inline Vec3<double> parts(const Quad& v) { return {v.q[0], v.q[1], v.q[2]}; }

template <class V>
void measure_arcs(size_t count, const SecondDerivatives<V>* shape, SixOf<V>* products) {
  constexpr const V* kind = nullptr;
  for (size_t i = 0; i < count; ++i) {
    const SecondDerivatives<V>& d = shape[i];
    products[i] = {three(dot(d.uu, d.uu), dot(d.uu, d.uv), dot(d.uu, d.vv), kind),
                   three(dot(d.uv, d.uv), dot(d.uv, d.vv), dot(d.vv, d.vv), kind)};
  }
}

// Adds to moment (as add_moments takes them) what the stresses of the triangles around each vertex do to its shape.
template <class V>
void add_arc_moments(const SheetData& sheet, const SecondDerivatives<V>* shape, const SixOf<V>* pulls,
                     SecondDerivatives<V>* moment) {
  for (size_t i = 0; i < static_cast<size_t>(sheet.vertex_count); ++i) {
    const double per_area = 1 / sheet.vertex_area[i];
    const auto low = parts(scaled(per_area, pulls[i].first)), high = parts(scaled(per_area, pulls[i].second));
    const SecondDerivatives<V>& d = shape[i];
    SecondDerivatives<V>& m = moment[i];
    m.uu = add_scaled(2.0 * low.x, d.uu, add_scaled(low.y, d.uv, add_scaled(low.z, d.vv, m.uu)));
    m.uv = add_scaled(0.5 * low.y, d.uu, add_scaled(high.x, d.uv, add_scaled(0.5 * high.y, d.vv, m.uv)));
    m.vv = add_scaled(low.z, d.uu, add_scaled(high.y, d.uv, add_scaled(2.0 * high.z, d.vv, m.vv)));
  }
}

// What a triangle's arcs add to its u, shear and v strains; products: means over its corners.
template <class G, class R>
inline Vec3<R> longer_by(const ArcWeights<G>& w, const SixOf<Vec3<R>>& products) {
  const auto sum = [&](const G(&weight)[6]) {
    const Vec3<R> first{weight[0] * products.first.x, weight[1] * products.first.y, weight[2] * products.first.z};
    return first.x + first.y + first.z + weight[3] * products.second.x + weight[4] * products.second.y +
           weight[5] * products.second.z;
  };
  return {sum(w.u), sum(w.shear), sum(w.v)};
}

// The stresses' pull at the products of each corner; stress: u, shear, v, times a third of the area.
template <class G, class R>
inline SixOf<Vec3<R>> pulls_of(const ArcWeights<G>& w, const Vec3<R>& stress) {
  const auto pull = [&](int k) { return w.u[k] * stress.x + w.shear[k] * stress.y + w.v[k] * stress.z; };
  return {{pull(0), pull(1), pull(2)}, {pull(3), pull(4), pull(5)}};
}

}  // namespace selvedge::cloth::kernel
