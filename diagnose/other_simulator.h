// What another simulator lacks of a recorded fabric, told by our sheet.
//
// Another program is not held near a recording, and knows none of our effects. So our sheet stands in for it. Its own
// motion, at its fitted parameters, is taken as a recording: the parameters with which our sheet predicts that motion
// are those that the program behaves as if it had, its numerical damping too. With these the recorded fabric is
// predicted, then with one group of them after another, and one effect after another, as the fabric itself has them.
// What each takes of the gap, in every order, is its part (budget.h). Errors are of the windows (windows.h), in trials
// that all was fitted to.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "diagnose/arm.h"
#include "diagnose/base_fit.h"
#include "diagnose/budget.h"
#include "model/simulator.h"

namespace selvedge::diagnose {

// Another simulator as it was fitted to the campaign.
struct FittedSimulator {
  std::shared_ptr<const model::Simulator> simulator;
  Eigen::VectorXd coordinates;  // of its parameters
};

// A base parameter of our sheet as a simulator behaves, and as the fabric does.
struct BehavesAs {
  std::string name, unit;
  double simulator = 0, fabric = 0;
};

struct SimulatorPart {
  std::string name;  // "no drag", "numerical damping", "elasticity", or an effect of the likeliest set, which it lacks
  std::vector<BehavesAs> parameters;  // of the group; none of an effect
  Share share;
  double alone_mm = 0;  // what is left where this alone is put right
};

struct SimulatorGap {
  std::string name, identity;  // empty: no other simulator was given
  double before_mm = 0;        // what our sheet leaves of the recording, behaving as the simulator
  double after_mm = 0;         // all put right
  double imitated_mm = 0;      // what our sheet leaves of the simulator's own motion: what it cannot imitate
  std::vector<SimulatorPart> parts;
  Share unexplained = {1, 1, 1};
  bool diverged = false;  // our sheet did, behaving so: there are no figures then
};

struct Imitation {
  Eigen::VectorXd base;  // coordinates of the base with which our sheet behaves as the simulator
  double left_mm = 0;
};

// options: of the diagnosis of the recording. Throws BadInput where the simulator diverges or breaks its protocol.
Imitation imitate(const trial::Campaign& campaign, const StudyOptions& options, const FittedSimulator& other);

// arm: the likeliest set; likeliest: all coordinates at its estimate.
SimulatorGap simulator_gap(Study& study, const Windows& windows, const Evidence& evidence, const Arm& arm,
                           const Eigen::VectorXd& likeliest, const Imitation& imitation);

}  // namespace selvedge::diagnose
