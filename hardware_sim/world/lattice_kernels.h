// The lattice sheet's forces, one lattice row at a time, compiled for plain x86-64 and for AVX2.
// p, v, f: pointers to the x, y, z planes at the row's first node. scratch: room for at least 6 · (n + 2) doubles.
#pragma once

namespace selvedge::hardware_sim::lattice {

struct Row {
  double *x, *y, *z;
};
struct ConstRow {
  const double *x, *y, *z;
};

// Edges along the row (n nodes, n − 1 edges of rest length h): force factor = area·(k E + c Ė)/h² times the edge.
void edges_along(ConstRow p, ConstRow v, Row f, int n, double h, double area, double k, double c, double* scratch);

// Edges from this row to the next. end_share: the factor of `area` at the row's two ends.
void edges_across(ConstRow p0, ConstRow v0, Row f0, ConstRow p1, ConstRow v1, Row f1, int n, double h, double area,
                  double end_share, double k, double c);

// Shear and twist of the cells between two rows.
void cells(ConstRow p0, ConstRow v0, Row f0, ConstRow p1, ConstRow v1, Row f1, int n, double hu, double hv,
           double shear, double shear_damping, double bend, double bend_damping, double* scratch);

// Bending along a line of nodes, three neighbours at a time: nodes come from three rows (p0, p1, p2 with forces
// f0, f1, f2); for bending along a row hand in the same row at offsets 0, 1, 2. area may differ at both ends.
void bends(ConstRow p0, ConstRow v0, ConstRow p1, ConstRow v1, ConstRow p2, ConstRow v2, double* const out[9], int n,
           double h, double area, double bend, double damping);

// Drag on the nodes of a row from normals by differences of the neighbours (left/right along the row are taken
// inside; up and down are the rows above and below, or the row itself at the rim).
void drag(ConstRow p, ConstRow up, ConstRow down, ConstRow v, Row f, int n, const double* area, const double air[3],
          double normal, double tangent, double fade);

}  // namespace selvedge::hardware_sim::lattice
