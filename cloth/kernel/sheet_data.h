// What the force kernels need of a mesh, in plain arrays (no Eigen: kernels are compiled for the widest
// vectors of the machine, and Eigen's types must not change between translation units).
#pragma once

#include <vector>

#include "cloth/material.h"

namespace selvedge::cloth::kernel {

// Triangle t: w_u = Σ_a gradient_u[a] x_a, w_v likewise; gradients sum to zero over the corners.
struct Triangle {
  int vertex[3];
  double gradient_u[3];   // 1/m
  double gradient_v[3];   // 1/m
  double membrane_area;   // m² that stretch and shear act on: flat, scaled at the corners that a rig holds (sheet.cpp)
  double corner_area[3];  // m², the parts of it nearest to each corner
};

// Second derivatives at a vertex by a least-squares quadratic through its neighbours:
// x_uu = Σ_k uu[k] x_{index[k]}, and so on; rows of a compressed matrix.
struct BendStencils {
  std::vector<int> start;  // N + 1
  std::vector<int> index;
  std::vector<double> uu, uv, vv;  // 1/m²
};

// What is added to the strains of a triangle because fabric bends between the ends of a side (arc_length.h):
// Σ weight · product, m², over uu·uu, uu·uv, uu·vv, uv·uv, uv·vv, vv·vv of the second derivatives. G: double, or one a
// lane.
template <class G>
struct ArcWeights {
  G u[6], shear[6], v[6];
};

// Bending of unit rigidity: energy ½ Σ x_i·Q_ij x_j; symmetric, compressed rows.
struct BendMatrix {
  std::vector<int> start;  // N + 1
  std::vector<int> index;
  std::vector<double> value;  // 1/m²
  // Consecutive rows with the values of the first, and its columns shifted as far as they are: all rows, in order.
  struct Alike {
    int first, count;
  };
  std::vector<Alike> alike;
};

// A vertex moved by the rig: position = left + along (right − left) + below · clamp direction.
struct HeldVertex {
  int vertex;
  double along;    // 0 at the left corner, 1 at the right
  double below_m;  // distance along clamp_direction, for a clamped edge
  // Share of its bending energy that is kept. A clamp at v = 0 that is made by holding two rows leaves the
  // curvature of the first 1.5 rows to the second row's stencil: energy ½B 1.5h κ² at 1.5 times the curvature.
  double bend_share = 1;
};

struct SheetData {
  int vertex_count = 0;
  std::vector<double> vertex_u, vertex_v;  // m
  std::vector<double> vertex_area;         // m², what lies nearer to it than to its neighbours
  std::vector<double> rim_distance;        // m, from the nearest rim
  std::vector<Triangle> triangles;
  BendStencils bend;
  BendMatrix bend_matrix;
  std::vector<ArcWeights<double>>
      arcs;  // one a triangle, or none: sides of triangles are as long as the fabric along them
  double width_m = 0, height_m = 0;
};

// What acts on the fabric from outside, for one run.
struct Surroundings {
  double gravity[3] = {0, 0, -9.81};   // m/s²
  double air_velocity[3] = {0, 0, 0};  // m/s, steady
};

}  // namespace selvedge::cloth::kernel
