// Simulating one recorded trial: equilibrium first where the fabric starts at rest, then the motion.
//
// An Experiment is plain data. Several experiments on the same sheet with the same times, but other
// materials, surroundings or paths, run together in SIMD lanes; each gives the bits that it gives alone.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "cloth/guide.h"
#include "cloth/held_path.h"
#include "cloth/kernel/run.h"
#include "cloth/sheet.h"
#include "cloth/smooth_force.h"
#include "cloth/state.h"
#include "cloth/stop.h"

namespace selvedge::cloth {

struct Experiment {
  Material material;
  HeldPath path;
  Eigen::Vector3d gravity_m_s2 = Eigen::Vector3d(0, 0, -9.81);
  Eigen::Vector3d air_velocity_m_s = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd start_shape;          // 3×N, m: where relaxation, or the motion itself, starts
  bool starts_at_rest = true;            // relax first
  Eigen::Matrix3Xd start_velocity = {};  // m/s, where it does not start at rest; no columns: none. Splines alone
  double start_s = 0;                    // in the path's time
  std::vector<double> sample_s;          // ascending; when positions are wanted, in the path's time
  std::function<kernel::StepFilter()>
      make_step_filter;                    // contact (contact/solver.h), afresh for each run, by any thread; null: none
  std::shared_ptr<const Guide> guide;      // keeps it near where it was seen; null: it runs free
  std::vector<SmoothForce> smooth_forces;  // that act all the time, at rest too; splines alone
  StopFlag stop = {};                      // of what runs on splines
  std::map<std::string, double> simulator_values;  // parameters of another simulator (model/simulator.h), by name
};

// What changes each step of a run of it, made afresh; empty where nothing does.
kernel::StepFilter step_filter_of(const Experiment& experiment);

inline constexpr double kImplicitStep_s = 1.0 / 120;

struct Options {
  enum class Integrator { leapfrog, runge_kutta_45, implicit_euler };
  Integrator integrator = Integrator::leapfrog;
  double step_s = 0;          // 0: leapfrog takes the stable step of the stiffest lane, implicit_euler kImplicitStep_s
  double tolerance_m = 1e-6;  // runge_kutta_45, error a step
  double rest_change_m = 2e-6;  // see kernel::RelaxOptions
  double rest_speed_m_s = 1e-4;
  double longest_rest_s = 12;  // fabric time after which relaxation gives up
};

struct Trajectory {
  std::vector<Eigen::Matrix3Xd> samples;  // 3×N at each sample_s, m
  Eigen::Matrix3Xd start;                 // equilibrium, or start_shape
  bool at_rest = true;                    // relaxation came to rest
  bool finite = true;                     // false: the motion diverged, samples are not to be used
  Eigen::Matrix3Xd end_velocity = {};     // m/s, at the last sample; of splines alone
};

// The leapfrog step that simulates a second with the least work (step_plan.h), s.
double stable_step_s(const Sheet& sheet, const Material& material);

// The shortest such step of all lanes, s.
double common_step_s(const Sheet& sheet, const std::vector<Experiment>& lanes);

// Any number of lanes, split into SIMD groups of lanes that take their steps alike, the groups over the cores. A lane
// that diverged is run again with half the step, up to three times. Throws std::invalid_argument where the lanes differ
// in start_s or sample_s.
std::vector<Trajectory> simulate(const Sheet& sheet, const std::vector<Experiment>& lanes, const Options& options = {});

// Equilibria of the lanes from their start shapes.
struct Rest {
  Eigen::Matrix3Xd position;
  bool at_rest = true;
};
std::vector<Rest> relax(const Sheet& sheet, const std::vector<Experiment>& lanes, const Options& options = {});

// The vertices that the rig holds.
std::vector<kernel::HeldVertex> held_vertices(const Sheet& sheet, Hold hold);

// A shape near equilibrium to start from, without stretch along the fabric's width: the sheet hung between
// the held corners, bulging to the side of the given sign (+1: along gravity × (right − left), −1: against).
Eigen::Matrix3Xd hung_shape(const Sheet& sheet, const Experiment& experiment, double side);

}  // namespace selvedge::cloth
