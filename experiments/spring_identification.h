// Identifying Provot's sheet from its motion, as Louchet, Provot & Crochemore 1995, section 3, do.
//
// Recorded: positions and velocities of all points at the frames of an animation, and one time step before each. A
// frame is predicted by one step from the recorded state before it. Cost over the frames compared:
//   f = Σ_frames Σ_points |P_p − P_r|² + Δt² |v_p − v_r|²,   m²
// `every_frame` is the paper's full cost, `last_frame` its small one. Five parameters: natural lengths of structural,
// shear and flexion springs, stiffness K, critical elongation τ.
//
// What the search varies:
//   lengths  the paper's: the five as they are
//   longest  ours: ln l(1 + τ) of the three kinds, ln K, ln(1 + τ)
// Inverse dynamics cuts springs to l(1 + τ), so that product is seen far more sharply than l or τ: the cost is a narrow
// bent valley in the paper's five, which steps along axes and uniform crossovers cannot follow. (The paper's
// bad case lies in it: 0.086170 · 1.630850 = 0.14053 where the reference has 0.09375 · 1.5 = 0.14063.)
#pragma once

#include "experiments/provot_sheet.h"
#include "estimate/optimisers/evolution.h"

namespace selvedge::experiments {

enum class SpringCost { every_frame, last_frame };
enum class SpringCoordinates { lengths, longest };

struct SpringFrame {
  cloth::State before, at;  // one time step apart
};

struct SpringRecording {
  ProvotScene scene;
  std::vector<SpringFrame> frames;
};

// A sheet let go from the level start and held by two corners: `frames` frames, one every `steps_a_frame` steps. The
// paper gives no masses; the scene's must be such that many springs come to τ, as it says they do.
SpringRecording record_springs(const ProvotScene& scene, const IsotropicFabric& reference, int frames,
                               int steps_a_frame);

double spring_cost(const SpringRecording& recording, const ProvotSheet& sheet, const IsotropicFabric& fabric,
                   SpringCost cost);

// The share of springs in the last frame that are longer than 0.99 l (1 + τ).
double share_at_critical(const SpringRecording& recording, const IsotropicFabric& reference);

Eigen::VectorXd to_coordinates(const IsotropicFabric& fabric, SpringCoordinates coordinates);
IsotropicFabric to_fabric(const Eigen::VectorXd& point, SpringCoordinates coordinates);

// Costs on all cores; the box holds the first values below and more. The recording must outlive the problem.
estimate::SearchProblem spring_problem(const SpringRecording& recording, SpringCost cost,
                                       SpringCoordinates coordinates);

// First values, from the lengths observed in the frames compared. `lengths`: natural ones 0.6 to 1.1 times the average,
// K 0.2 to 20 N/m, τ 0.02 to 1. `longest`: l(1 + τ) from the average to 1.1 times the longest, K and τ as before.
estimate::EvolutionOptions spring_evolution(const SpringRecording& recording, SpringCost cost,
                                            SpringCoordinates coordinates);

}  // namespace selvedge::experiments
