// What two surfaces in contact do to each other in one step, as an impulse.
//
// After R. Bridson, R. Fedkiw & J. Anderson, Robust treatment of collisions, contact, and friction for cloth
// animation, SIGGRAPH 2002, evaluated as Bhat et al. 2003 do: inside the solver, every time it evaluates forces.
// Two features at distance d approach with v_N (negative: closer), m their effective mass.
//   repulsion   J = m max(0, ω² h (t − d) − 2ζω h v_N)   where d < t: a spring, so that what it gives back was
//               taken before, with damping; ωh is kept at 0.3 or below
//   inelastic   J raised until the gap left after the step is at least a quarter of t
//   friction    |J_T| ≤ μ J, up to what stops sliding
// Each impulse lies along a pair's relative motion and never reverses it beyond the spring's push: contact
// takes energy and gives none.
#pragma once

#include <Eigen/Core>

namespace selvedge::cloth::contact {

struct Law {
  double thickness_m = 1e-3;   // t, distance below which surfaces repel
  double rate_1_s = 1500;      // ω of the repulsion
  double damping_ratio = 0.5;  // ζ
  double friction = 0.3;       // μ, Coulomb, static and sliding
};

// Impulse on the first side, N·s. relative_velocity: of the first side to the second. inverse_mass: of the pair.
// least_speed: what v_N is raised to at least (the inelastic part).
Eigen::Vector3d impulse_of(const Law& law, double step_s, double gap_m, const Eigen::Vector3d& normal,
                           const Eigen::Vector3d& relative_velocity, double inverse_mass, double least_speed);

// The least approach speed that leaves a quarter of the thickness, m/s; 0 where less is left already.
double least_speed(const Law& law, double step_s, double gap_m);

// Stops the approach along the normal, with friction.
Eigen::Vector3d stopping_impulse(double friction, const Eigen::Vector3d& normal,
                                 const Eigen::Vector3d& relative_velocity, double inverse_mass);

}  // namespace selvedge::cloth::contact
