// Energy of a sheet, J, term by term, from the formulas of material.h (no friction, creep, rest curvature).
#pragma once

#include "cloth/sheet.h"
#include "cloth/material.h"

namespace selvedge::cloth {

struct Energy {
  double kinetic = 0, gravity = 0, stretch = 0, shear = 0, bend = 0;
  double potential() const { return gravity + stretch + shear + bend; }
  double total() const { return kinetic + potential(); }
};

// kg, of each vertex.
Eigen::VectorXd vertex_masses(const Sheet& sheet, const Material& material);

// position, velocity: 3×N, m and m/s.
Energy energy_of(const Sheet& sheet, const Material& material, const Eigen::Vector3d& gravity_m_s2,
                 const Eigen::Matrix3Xd& position, const Eigen::Matrix3Xd& velocity);

// Half the power that the material's damping takes, W: its forces are −∂/∂velocity of this.
double damping_potential(const Sheet& sheet, const Material& material, const Eigen::Matrix3Xd& position,
                         const Eigen::Matrix3Xd& velocity);

}  // namespace selvedge::cloth
