// Runs of one experiment in SIMD lanes: leapfrog in time, and relaxation to rest.
//
// Leapfrog (Störmer–Verlet) is symplectic: it neither damps nor feeds the sheet.
//   v_{n+½} = v_{n−½} + h a(x_n, v_{n−½}),  x_{n+1} = x_n + h v_{n+½}.
// Drag sees the velocity of half a step before. So does the material's damping where it is weak; where its
// fast modes would make the step unstable, the first line is taken in stages (step_plan.h), each of which
// costs the damping forces alone.
// Arrays are lane-major: entry (lane, vertex, axis) of a state at (lane·N + vertex)·3 + axis.
#pragma once

#include <vector>

#include "cloth/kernel/sheet_data.h"
#include "cloth/kernel/step_filter.h"

namespace selvedge::cloth::kernel {

// Runs side by side: 8 where the processor has AVX-512, else 4.
int most_lanes();

// Stages of one step under damping: v_{n+½} = v_{n−½} + δ_last with δ_0 = 0,
// δ_j = mu_j δ_{j−1} + nu_j δ_{j−2} + gain_j h (a(x_n, v_{n−½}) − M⁻¹D δ_{j−1}).
struct DampingStages {
  static constexpr int kMost = 16;
  int count = 1;
  double mu[kMost] = {0}, nu[kMost] = {0}, gain[kMost] = {1};
};

struct RunInput {
  const SheetData* sheet = nullptr;
  int lanes = 1;                           // 1 to most_lanes()
  std::vector<Material> materials;         // one a lane
  std::vector<Surroundings> surroundings;  // one a lane
  std::vector<double> start_position;      // lanes × N × 3, m
  std::vector<double> start_velocity;      // lanes × N × 3, m/s; empty: at rest
  std::vector<HeldVertex> held;
  double clamp_direction[3] = {0, 0, -1};
  double step_s = 0;
  int steps = 0;
  DampingStages stages;
  // The held corners at every step: entry (lane, step 0…steps, corner 0 left 1 right, axis).
  std::vector<double> held_corners;
  std::vector<double> sample_s;          // ascending times from the start at which positions are kept
  double start_s = 0;                    // of the run, for the step filters
  std::vector<StepFilter> step_filters;  // one a lane, or none
  int filter_every = 1;                  // steps
};

struct RunOutput {
  std::vector<double> samples;         // (lane, sample, vertex, axis), m
  std::vector<double> final_position;  // lanes × N × 3
  std::vector<double> final_velocity;  // at the last half step
  std::vector<bool> finite;            // per lane: no overflow on the way
};

// A lane's bits do not depend on its companions where all or none of them bend uniformly (lane_material.h).
RunOutput run(const RunInput& input);

struct RelaxOptions {
  double step_s = 0;
  int max_steps = 0;
  double check_s = 2e-3;    // kinetic energy is looked at this often
  double speed_m_s = 1e-4;  // at rest: the fastest vertex at a peak of kinetic energy is slower than this
  double change_m = 2e-6;   // and moved less than this since the peak before
};

struct RelaxOutput {
  std::vector<double> position;  // lanes × N × 3, m
  std::vector<bool> at_rest;     // per lane
  std::vector<int> steps;        // per lane, until rest
};

// Kinetic damping: the sheet is stopped at each peak of its kinetic energy until it rests. Held corners stay
// where held_corners (one entry a lane and corner: lanes × 2 × 3) puts them.
RelaxOutput relax(const RunInput& input, const RelaxOptions& options);

}  // namespace selvedge::cloth::kernel
