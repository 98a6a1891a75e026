// The loops over triangles (triangle.h), which add to the forces at the vertices in the order of the triangles.
#pragma once

#include <vector>

#include "cloth/kernel/arc_length.h"
#include "cloth/kernel/triangle.h"

namespace selvedge::cloth::kernel {

// Triangles as the loops take them: one by one for lanes of runs, four by four for a single run.
struct PackedTriangles {
  struct Four {
    FlatTriangle<Lanes4> flat;
    int vertex[3][4];
    ArcWeights<Lanes4> arcs;  // where the sheet has them
    int count;                // fewer than four at the end; the rest repeat the last
  };
  std::vector<Four> fours;
  explicit PackedTriangles(const SheetData& sheet) {
    const size_t count = sheet.triangles.size();
    for (size_t first = 0; first < count; first += 4) {
      Four four{};
      four.count = static_cast<int>(count - first < 4 ? count - first : 4);
      for (int i = 0; i < 4; ++i) {
        const Triangle& t = sheet.triangles[first + static_cast<size_t>(i < four.count ? i : four.count - 1)];
        for (int a = 0; a < 3; ++a) {
          four.vertex[a][i] = t.vertex[a];
          four.flat.corner[a][i] = t.corner_area[a];
        }
        four.flat.u1[i] = t.gradient_u[1];
        four.flat.u2[i] = t.gradient_u[2];
        four.flat.v1[i] = t.gradient_v[1];
        four.flat.v2[i] = t.gradient_v[2];
        four.flat.area[i] = t.membrane_area;
        if (sheet.arcs.empty()) continue;
        const ArcWeights<double>& arcs = sheet.arcs[first + static_cast<size_t>(i < four.count ? i : four.count - 1)];
        for (int k = 0; k < 6; ++k) {
          four.arcs.u[k][i] = arcs.u[k];
          four.arcs.shear[k][i] = arcs.shear[k];
          four.arcs.v[k][i] = arcs.v[k];
        }
      }
      fours.push_back(four);
    }
  }
};

inline FlatTriangle<double> flat(const Triangle& t) {
  return {t.gradient_u[1], t.gradient_u[2], t.gradient_v[1],
          t.gradient_v[2], t.membrane_area, {t.corner_area[0], t.corner_area[1], t.corner_area[2]}};
}

template <class R>
inline Sides<R> sides(const Vec3<R>& zero, const Vec3<R>& one, const Vec3<R>& two) {
  return {one - zero, two - zero};
}

inline Vec3<Lanes4> gather(const int (&vertex)[4], const Quad* y) {
  return lanes_of_quads(y[vertex[0]], y[vertex[1]], y[vertex[2]], y[vertex[3]]);
}

inline SixOf<Vec3<Lanes4>> gather(const int (&vertex)[4], const SixOf<Quad>* y) {
  const SixOf<Quad>&a = y[vertex[0]], &b = y[vertex[1]], &c = y[vertex[2]], &d = y[vertex[3]];
  return {lanes_of_quads(a.first, b.first, c.first, d.first), lanes_of_quads(a.second, b.second, c.second, d.second)};
}

// The same to each corner.
inline void scatter(const PackedTriangles::Four& t, const SixOf<Vec3<Lanes4>>& pull, SixOf<Quad>* to) {
  Quad first[4], second[4];
  quads_of_lanes(pull.first, first);
  quads_of_lanes(pull.second, second);
  for (int i = 0; i < t.count; ++i)
    for (const auto& corner : t.vertex) {
      to[corner[i]].first += first[i];
      to[corner[i]].second += second[i];
    }
}

inline void scatter(const PackedTriangles::Four& t, const CornerForces<Lanes4>& f, Quad* force) {
  Quad zero[4], one[4], two[4];
  quads_of_lanes(f.zero, zero);
  quads_of_lanes(f.one, one);
  quads_of_lanes(f.two, two);
  for (int i = 0; i < t.count; ++i) {
    force[t.vertex[0][i]] += zero[i];
    force[t.vertex[1][i]] += one[i];
    force[t.vertex[2][i]] += two[i];
  }
}

// Of each vertex: the products of its second derivatives, and what pulls at them, which is added to (arc_length.h).
template <class V>
struct Arcs {
  const SixOf<V>* products = nullptr;
  SixOf<V>* pulls = nullptr;
};

// Each adds to force. memory: one a triangle, or one a pack of four. step_s: of the memory; 0 leaves it.
// frames: likewise, filled for membrane_damping where not null. arcs: where the sheet measures them.
template <class R>
void membrane_and_drag(const SheetData& sheet, const PackedTriangles&, const LaneMaterial<R>& p, const Vec3<R>* x,
                       const Vec3<R>* v, MembraneMemory<R>* memory, double step_s, DampingShares<R>* frames,
                       const Arcs<Vec3<R>>& arcs, Vec3<R>* force) {
  for (size_t i = 0; i < sheet.triangles.size(); ++i) {
    const Triangle& t = sheet.triangles[i];
    const int a = t.vertex[0], b = t.vertex[1], c = t.vertex[2];
    Vec3<R> longer, stress;
    if (arcs.products) {
      const SixOf<Vec3<R>>&p0 = arcs.products[a], &p1 = arcs.products[b], &p2 = arcs.products[c];
      longer = scaled(1.0 / 3.0, longer_by(sheet.arcs[i], SixOf<Vec3<R>>{p0.first + p1.first + p2.first,
                                                                         p0.second + p1.second + p2.second}));
    }
    const auto f = triangle_forces(flat(t), sides(x[a], x[b], x[c]), sides(v[a], v[b], v[c]), v[a] + v[b] + v[c], p,
                                   memory + i, step_s, frames ? frames + i : nullptr, arcs.products ? &longer : nullptr,
                                   arcs.products ? &stress : nullptr);
    force[a] += f.zero;
    force[b] += f.one;
    force[c] += f.two;
    if (arcs.products) {
      const SixOf<Vec3<R>> pull = pulls_of(sheet.arcs[i], stress);
      for (const int corner : t.vertex) {
        arcs.pulls[corner].first += pull.first;
        arcs.pulls[corner].second += pull.second;
      }
    }
  }
}

inline void membrane_and_drag(const SheetData&, const PackedTriangles& packed, const LaneMaterial<Lanes4>& p,
                              const Quad* x, const Quad* v, MembraneMemory<Lanes4>* memory, double step_s,
                              Frame<Lanes4>* frames, const Arcs<Quad>& arcs, Quad* force) {
  for (size_t i = 0; i < packed.fours.size(); ++i) {
    const PackedTriangles::Four& t = packed.fours[i];
    const Vec3<Lanes4> v0 = gather(t.vertex[0], v), v1 = gather(t.vertex[1], v), v2 = gather(t.vertex[2], v);
    const auto x_sides = sides(gather(t.vertex[0], x), gather(t.vertex[1], x), gather(t.vertex[2], x));
    Vec3<Lanes4> longer, stress;
    if (arcs.products) {
      SixOf<Vec3<Lanes4>> sum = gather(t.vertex[0], arcs.products);
      for (const int k : {1, 2}) {
        const SixOf<Vec3<Lanes4>> more = gather(t.vertex[k], arcs.products);
        sum.first += more.first;
        sum.second += more.second;
      }
      longer = scaled(1.0 / 3.0, longer_by(t.arcs, sum));
    }
    scatter(t,
            triangle_forces(t.flat, x_sides, sides(v0, v1, v2), v0 + v1 + v2, p, memory + i, step_s,
                            frames ? frames + i : nullptr, arcs.products ? &longer : nullptr,
                            arcs.products ? &stress : nullptr),
            force);
    if (arcs.products) scatter(t, pulls_of(t.arcs, stress), arcs.pulls);
  }
}

// What membrane_and_drag keeps of the shape for membrane_damping.
template <class V>
struct KeptFrame;
template <class R>
struct KeptFrame<Vec3<R>> {
  using Type = DampingShares<R>;
};
template <>
struct KeptFrame<Quad> {
  using Type = Frame<Lanes4>;
};

// Membrane damping of the velocities v at the shape x; adds to force.
template <class R>
void membrane_damping(const SheetData& sheet, const PackedTriangles&, const LaneMaterial<R>& p,
                      const DampingShares<R>* shares, const Vec3<R>* x, const Vec3<R>* v, Vec3<R>* force) {
  for (size_t i = 0; i < sheet.triangles.size(); ++i) {
    const Triangle& t = sheet.triangles[i];
    const int a = t.vertex[0], b = t.vertex[1], c = t.vertex[2];
    const FlatTriangle<double> at_rest = flat(t);
    const Sides<R> shape = sides(x[a], x[b], x[c]);
    const Frame<R> frame{along_u(at_rest, shape), along_v(at_rest, shape), shares[i]};
    const auto f = triangle_damping(at_rest, frame, sides(v[a], v[b], v[c]), p);
    force[a] += f.zero;
    force[b] += f.one;
    force[c] += f.two;
  }
}

inline void membrane_damping(const SheetData&, const PackedTriangles& packed, const LaneMaterial<Lanes4>& p,
                             const Frame<Lanes4>* frames, const Quad*, const Quad* v, Quad* force) {
  for (size_t i = 0; i < packed.fours.size(); ++i) {
    const PackedTriangles::Four& t = packed.fours[i];
    const auto v_sides = sides(gather(t.vertex[0], v), gather(t.vertex[1], v), gather(t.vertex[2], v));
    scatter(t, triangle_damping(t.flat, frames[i], v_sides, p), force);
  }
}

}  // namespace selvedge::cloth::kernel
