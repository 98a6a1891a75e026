// The fabric's forces against the energies that they come from, and what they conserve, on a crumpled irregular mesh:
// the worse of one with straight sides and one with arcs.
#pragma once

#include "cloth/material.h"

namespace selvedge::cli {

// A fabric without damping and drag.
cloth::Material lossless();

// Largest difference of a force from minus the gradient of its energy (central differences with Richardson's
// extrapolation), as a share of the largest force. stretched: by a fifth both ways, where stiffening has a gradient.
double energy_gradient_error(const cloth::Material& material, bool stretched = false);

// The same on a crumpled sheet of splines of five cells.
double spline_gradient_error(const cloth::Material& material, bool stretched = false);

// On triangles, the same of the damping forces and half the power that they take.
double damping_gradient_error(const cloth::Material& material);

// Sum of the forces, and of their torques (m), as shares of the sum of the forces' sizes.
struct Unbalanced {
  double force = 0, torque_m = 0;
};
Unbalanced unbalanced(const cloth::Material& material);

}  // namespace selvedge::cli
