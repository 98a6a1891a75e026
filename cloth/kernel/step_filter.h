// What may change a step of one run before it is taken for good: contact. Where there is none the step costs
// nothing and keeps its bits.
#pragma once

#include <cstddef>
#include <functional>

namespace selvedge::cloth::kernel {

// Arrays of vertex_count × 3, vertex by vertex. A filter that changes the velocity of a vertex over the step by
// Δ sets after += step_s Δ and velocity += Δ.
struct Step {
  double start_s = 0;  // in the path's time
  double step_s = 0;
  double since_s = 0;  // since the filter last ran: step_s, or of several steps (RunInput::filter_every)
  size_t vertex_count = 0;
  const double* before = nullptr;        // m, at start_s
  double* after = nullptr;               // m, at start_s + step_s
  double* velocity = nullptr;            // m/s, what the integrator goes on with
  const double* inverse_mass = nullptr;  // vertex_count, 1/kg; 0 for a vertex that the rig holds
};

using StepFilter = std::function<void(const Step&)>;

}  // namespace selvedge::cloth::kernel
