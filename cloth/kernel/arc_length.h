// Sides of triangles are chords: of fabric that is bent along a side, more lies between its ends than their distance.
//
// A side d (flat, m) of a curve with second derivative c = x'' along it, taken once over the side (c = d·H·d, m), has
// |Δx|² = l² − |c|²/12 + O(l⁶) where the fabric between is l long. The metric that makes the three sides of a triangle
// longer by |c|²/12 each is added to the triangle's strains, with H at its corners:
//   ε_u += ½ δ_uu,  s += δ_uv,  ε_v += ½ δ_vv.
// Without it a sheet of spacing h under tension T bends as if its rigidity were T h²/12 less: a third at
// 25 mm for a soft swatch under its own weight (docs/decisions/0010). δ is quadratic in the positions
// and its force the exact derivative of the energy, so that nothing is damped or fed.
#pragma once

#include "cloth/kernel/bending.h"

namespace selvedge::cloth::kernel {

// Three numbers a vertex, one each for u, shear and v.
template <class R>
inline Vec3<R> three(const R& u, const R& shear, const R& v, const Vec3<R>*) {
  return {u, shear, v};
}
inline Quad three(double u, double shear, double v, const Quad*) { return {Lanes4{u, shear, v, 0}}; }
inline Vec3<Lanes4> parts(const Vec3<Lanes4>& v) { return v; }
inline Vec3<double> parts(const Quad& v) { return {v.q[0], v.q[1], v.q[2]}; }

template <class R>
inline R weighted(const double (&weight)[6], const R (&product)[6]) {
  R sum = weight[0] * product[0];
  for (int k = 1; k < 6; ++k) sum = fused(broadcast<R>(weight[k]), product[k], sum);
  return sum;
}

// Fills longer[vertex] with what is added to the strains, from the shapes.
template <class V>
void measure_arcs(const SheetData& sheet, const SecondDerivatives<V>* shape, V* longer) {
  using R = ScalarOf<V>;
  for (size_t i = 0; i < sheet.arcs.size(); ++i) {
    const SecondDerivatives<V>& d = shape[i];
    const R product[6] = {dot(d.uu, d.uu), dot(d.uu, d.uv), dot(d.uu, d.vv), dot(d.uv, d.uv), dot(d.uv, d.vv), dot(d.vv, d.vv)};
    const ArcWeights& a = sheet.arcs[i];
    longer[i] = three(weighted(a.u, product), weighted(a.shear, product), weighted(a.v, product), static_cast<const V*>(nullptr));
  }
}

// Adds to moment (as add_moments takes them) what the stresses of the triangles around each vertex, N·m, do to its shape.
template <class V>
void add_arc_moments(const SheetData& sheet, const SecondDerivatives<V>* shape, const V* stress, SecondDerivatives<V>* moment) {
  using R = ScalarOf<V>;
  for (size_t i = 0; i < sheet.arcs.size(); ++i) {
    const ArcWeights& a = sheet.arcs[i];
    const auto s = parts(stress[i]);
    R load[6];
    const double per_area = 1 / sheet.vertex_area[i];
    for (int k = 0; k < 6; ++k) load[k] = per_area * fused(broadcast<R>(a.v[k]), s.z, fused(broadcast<R>(a.shear[k]), s.y, a.u[k] * s.x));
    const SecondDerivatives<V>& d = shape[i];
    SecondDerivatives<V>& m = moment[i];
    m.uu = add_scaled(2.0 * load[0], d.uu, add_scaled(load[1], d.uv, add_scaled(load[2], d.vv, m.uu)));
    m.uv = add_scaled(0.5 * load[1], d.uu, add_scaled(load[3], d.uv, add_scaled(0.5 * load[4], d.vv, m.uv)));
    m.vv = add_scaled(load[2], d.uu, add_scaled(load[4], d.uv, add_scaled(2.0 * load[5], d.vv, m.vv)));
  }
}

}  // namespace selvedge::cloth::kernel
