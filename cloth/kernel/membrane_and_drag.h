// The loops over triangles (triangle.h), which add to the forces at the vertices in the order of the triangles.
#pragma once

#include <vector>

#include "cloth/kernel/triangle.h"

namespace selvedge::cloth::kernel {

// Triangles as the loops take them: one by one for lanes of runs, four by four for a single run.
struct PackedTriangles {
  struct Four {
    FlatTriangle<Lanes4> flat;
    int vertex[3][4];
    int count;  // fewer than four at the end; the rest repeat the last
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
      }
      fours.push_back(four);
    }
  }
};

inline FlatTriangle<double> flat(const Triangle& t) {
  return {t.gradient_u[1], t.gradient_u[2], t.gradient_v[1], t.gradient_v[2], t.membrane_area,
          {t.corner_area[0], t.corner_area[1], t.corner_area[2]}};
}

template <class R>
inline Sides<R> sides(const Vec3<R>& zero, const Vec3<R>& one, const Vec3<R>& two) {
  return {one - zero, two - zero};
}

inline Vec3<Lanes4> gather(const int (&vertex)[4], const Quad* y) {
  return lanes_of_quads(y[vertex[0]], y[vertex[1]], y[vertex[2]], y[vertex[3]]);
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

// Of each vertex: what is added to the strains around it, and the sum of the stresses, which are added to (arc_length.h).
template <class V>
struct Arcs {
  const V* longer = nullptr;
  V* stress = nullptr;
};

// Each adds to force. memory: one a triangle, or one a pack of four. step_s: of the memory; 0 leaves it.
// frames: likewise, filled for membrane_damping where not null. arcs: where the sheet measures them.
inline void membrane_and_drag(const SheetData& sheet, const PackedTriangles&, const LaneMaterial<Lanes4>& p,
                              const Vec3<Lanes4>* x, const Vec3<Lanes4>* v, MembraneMemory<Lanes4>* memory,
                              double step_s, DampingShares<Lanes4>* frames, const Arcs<Vec3<Lanes4>>& arcs, Vec3<Lanes4>* force) {
  for (size_t i = 0; i < sheet.triangles.size(); ++i) {
    const Triangle& t = sheet.triangles[i];
    const int a = t.vertex[0], b = t.vertex[1], c = t.vertex[2];
    Vec3<Lanes4> longer, stress;
    if (arcs.longer) longer = scaled(1.0 / 3.0, arcs.longer[a] + arcs.longer[b] + arcs.longer[c]);
    const auto f = triangle_forces(flat(t), sides(x[a], x[b], x[c]), sides(v[a], v[b], v[c]), v[a] + v[b] + v[c], p, memory + i,
                                   step_s, frames ? frames + i : nullptr, arcs.longer ? &longer : nullptr, arcs.longer ? &stress : nullptr);
    force[a] += f.zero;
    force[b] += f.one;
    force[c] += f.two;
    if (arcs.longer)
      for (const int corner : t.vertex) arcs.stress[corner] += stress;
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
    if (arcs.longer)
      longer = scaled(1.0 / 3.0, gather(t.vertex[0], arcs.longer) + gather(t.vertex[1], arcs.longer) + gather(t.vertex[2], arcs.longer));
    scatter(t, triangle_forces(t.flat, x_sides, sides(v0, v1, v2), v0 + v1 + v2, p, memory + i, step_s, frames ? frames + i : nullptr,
                               arcs.longer ? &longer : nullptr, arcs.longer ? &stress : nullptr),
            force);
    if (arcs.longer) scatter(t, {stress, stress, stress}, arcs.stress);
  }
}

// What membrane_and_drag keeps of the shape for membrane_damping.
template <class V>
struct KeptFrame;
template <>
struct KeptFrame<Vec3<Lanes4>> {
  using Type = DampingShares<Lanes4>;
};
template <>
struct KeptFrame<Quad> {
  using Type = Frame<Lanes4>;
};

// Membrane damping of the velocities v at the shape x; adds to force.
inline void membrane_damping(const SheetData& sheet, const PackedTriangles&, const LaneMaterial<Lanes4>& p,
                             const DampingShares<Lanes4>* shares, const Vec3<Lanes4>* x, const Vec3<Lanes4>* v,
                             Vec3<Lanes4>* force) {
  for (size_t i = 0; i < sheet.triangles.size(); ++i) {
    const Triangle& t = sheet.triangles[i];
    const int a = t.vertex[0], b = t.vertex[1], c = t.vertex[2];
    const FlatTriangle<double> at_rest = flat(t);
    const Sides<Lanes4> shape = sides(x[a], x[b], x[c]);
    const Frame<Lanes4> frame{along_u(at_rest, shape), along_v(at_rest, shape), shares[i]};
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
