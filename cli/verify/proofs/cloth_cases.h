// Fabric in situations with a known answer, each beside it.
#pragma once

#include <vector>

#include "cloth/simulate.h"
#include "cloth/spline/spline_sheet.h"

namespace selvedge::cli {

// Side of the square sheets, m.
inline constexpr double kSwatch_m = 0.3;

struct Compared {
  double simulated = 0;
  double reference = 0;
  double relative_error() const;
};

// Sag of the free edge of a sheet clamped along its top edge and held out level, against the elastica
// B θ'' = −ρ g (L − s) cos θ, θ(0) = 0, θ'(L) = 0, m. B such that it droops by more than half its length.
Compared cantilever_sag(int rows);

// Sag of a limp sheet between two bars, against the catenary of its length, m.
Compared catenary_sag(int columns);

// Period of the slowest small swing of a limp sheet on a bar, against the hanging chain's 2π/(1.2024 √(g/L)), s.
Compared pendulum_period(int rows);

// The same three on bicubic splines of so many cells along the direction that matters. The pendulum has 1e-5 N·m for
// 1e-7: cells far longer than the bending length carry it badly (decision 23).
Compared spline_cantilever_sag(int cells);
Compared spline_catenary_sag(int cells);
Compared spline_pendulum_period(int cells);

// Speed of a sheet that falls flat, against ρ g = c v²/(1 + f v²), m/s.
Compared terminal_speed(int rows);

// Bending energy of a sheet rolled to a cylinder of radius 10 cm about an axis turned by angle_rad in its
// plane, against ½ B κ² per area, J.
Compared cylinder_energy(const geometry::TriangleMesh& mesh, double angle_rad);

// Largest change of total energy of a swinging sheet without any damping, as a share of the energy that it
// has to move with.
double energy_drift(int rows, double duration_s);

// Share of its energy above rest that a swinging sheet without any damping still has after duration_s. step_s: of the
// integrator, 0 for its own choice.
double energy_kept(int rows, double duration_s, cloth::Options::Integrator integrator, double step_s = 0);

// The same on bicubic splines, in double precision, at a third of the planned step.
double spline_energy_kept(int cells, double duration_s);

// A 0.3 m sheet of 5e-5 N·m and 0.16 kg/m², its right corner moved 10 cm at 1.5 Hz, frames at 30 Hz. It starts from
// the equilibrium next to that of `branch`, or next to a hung shape where there is none.
struct Waving {
  cloth::Sheet sheet;
  cloth::Trajectory motion;
};
cloth::Experiment waving_experiment(double amplitude_m, int frames);
Waving wave(const geometry::TriangleMesh& mesh, int frames, const Waving* branch = nullptr);

// Root mean square distance over all frames at the vertices of a 17 × 17 grid, m.
double distance_m(const Waving& a, const Waving& b);

// The same swatch and motion on splines of so many cells, its 17 × 17 points at each frame.
struct SplineWaving {
  cloth::spline::SplineSheet sheet;
  Eigen::Matrix3Xd rest;
  std::vector<Eigen::Matrix3Xd> points;
};
SplineWaving spline_wave(int cells, int frames, const SplineWaving* branch = nullptr);
double distance_m(const SplineWaving& a, const SplineWaving& b);

// What nine derivatives of a motion cost on splines of so many cells, in simulations of that motion alone, both on one
// thread.
double cost_of_nine_derivatives(int cells);

// Order p of an error C hᵖ from the differences of three meshes of spacing 4h, 2h and h.
double order_of(double coarse_difference, double fine_difference);

}  // namespace selvedge::cli
