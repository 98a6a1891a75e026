// `simulator/1`: what a simulator and Selvedge say to each other over the simulator's standard input and output. A page
// about it: docs/simulator.md.
//
// One JSON object a line, UTF-8, metres, seconds, kilograms. The simulator first says what it can do (Hello). Then it
// is told trials ("do": "trial"), which it keeps and does not answer, and runs of them ("do": "run"), each of which it
// answers in order, with positions or with why there are none. Positions come for each time, in it for each point: x,
// y, z; as a list in the answer's line, or behind it as so many little-endian 32-bit floats or 64-bit doubles.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "cloth/held_path.h"

namespace selvedge::station {

struct SimulatorParameter {
  std::string name, unit;
  double usual = 0, lower = 0, upper = 0;
  bool logarithmic = false;        // fitted as its logarithm
  bool motion_only = false;        // where the fabric hangs at rest does not depend on it
  std::vector<double> tried = {};  // where to begin a fit, every combination of these is tried
};

struct SimulatorHello {
  std::string name, version;
  std::vector<SimulatorParameter> parameters;
  std::vector<cloth::Hold> holds;  // ways of holding that it can do
  bool start_shape = false;        // it seeks equilibrium from a shape, and begins a motion at one
  int at_once = 1;                 // how many runs it likes to be told before it answers the first
  int processes = 0;               // at most so many of it beside each other; 0: as many as there are threads
};

// What a run is of. (u, v): metres on the flat swatch, from the left held corner to the right one, and down.
struct SimulatorTrial {
  double width_m = 0, height_m = 0, mass_kg = 0;
  cloth::Hold hold = cloth::Hold::corners;
  Eigen::Vector3d clamp_direction = Eigen::Vector3d(0, 0, -1);  // top_edge_clamped: along which the sheet leaves it
  std::vector<double> grip_s;                                   // ascending; linear between, at rest outside
  Eigen::Matrix3Xd left, right;                                 // of the grips at these times, m
  Eigen::Vector3d gravity_m_s2 = Eigen::Vector3d::Zero();
  double start_s = 0;                   // until then it hangs at rest
  std::vector<Eigen::Vector2d> points;  // that are asked for
  std::vector<double> time_s;           // when, ascending, from start_s on

  bool operator==(const SimulatorTrial&) const = default;
};

struct SimulatorRun {
  int number = 0, trial = 0;
  std::map<std::string, double> parameters;
  Eigen::Matrix3Xd start;  // of a simulator with start_shape: the points' places from which to seek equilibrium
  bool hangs = true;       // false: it begins at `start`, at rest
  bool more = false;       // another run follows at once
};

const char* to_text(cloth::Hold hold);

// Each line without its end. Readers throw BadInput that begins with `where`.
std::string hello_line(const SimulatorHello& hello);
SimulatorHello hello_from(const std::string& line, const std::string& where);

std::string trial_line(int number, const SimulatorTrial& trial);
std::string run_line(const SimulatorRun& run);

// The head of an answer: positions follow, are in it, or there is an error.
struct SimulatorAnswer {
  int run = 0;
  size_t floats = 0, doubles = 0;  // that follow
  std::vector<double> positions;   // that are in it
  std::string error;               // not empty: it diverged, as it says
};
SimulatorAnswer answer_from(const std::string& line, const std::string& where, const SimulatorTrial& asked);

}  // namespace selvedge::station
