// What a diagnosis says.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "diagnose/base_fit.h"
#include "diagnose/looked_at.h"
#include "diagnose/missing_force.h"
#include "diagnose/next_experiment.h"
#include "diagnose/other_simulator.h"
#include "diagnose/replay.h"
#include "diagnose/sizes.h"
#include "diagnose/where.h"

namespace selvedge::diagnose {

// What is known of one effect.
struct EffectFinding {
  std::string name, summary;
  Side side = Side::elastic;
  double absorbed = 0;              // share of its trace in the data that a refit of the base takes up
  double screened_gain = 0;         // share of the base's squared residual that it explains beyond that, linearly
  bool weighed = false;             // sized, and its reduction found
  std::vector<std::string> beside;  // the other effects of the set in which that was done
  std::vector<SizedParameter> size;
  std::vector<SizedParameter> at_most;  // if it is not named; empty: data do not show it however large it is
  GapReduction reduction;
  double probability = 0, inclusion = 0;
};

struct BaseParameter {
  std::string name, unit;
  double value = 0, corrected = 0;  // alone, and with the likeliest effects added
};

// A set of effects, as it was weighed.
struct WeighedSet {
  std::string name;  // "none", "a", "a+b"
  bool and_unknown = false;
  double probability = 0, model_error = 0;  // s (evidence.h), of what it is in a right model
};

struct Diagnosis {
  Protocol protocol;
  std::string campaign, base;
  std::string input;  // hash of the recordings, the settings and the code
  double gap_mm = 0, low_mm = 0, high_mm = 0, noise_floor_mm = 0, right_floor_mm = 0, p_value = 1;
  // low_mm, high_mm: NaN of one group of trials alone, which cannot tell; then p_value means nothing either.
  size_t groups = 0;
  double before_mm = 0;
  bool is_ahead = false;  // errors are of predictions Protocol::free_s ahead
  std::string side, cause;
  std::map<std::string, double> probability, inclusion;
  std::vector<std::string> confusable;
  std::vector<std::string> cannot_tell;  // effects that the data could not show, however large
  std::vector<EffectFinding> effects;    // by probability
  std::vector<WeighedSet> sets;          // the likeliest
  Budget budget;
  MissingForce missing_force;
  std::vector<report::MovingSheet> replay;  // the base, and the likeliest set where it has effects
  std::string likeliest;                    // the set whose budget it is: "none", "a", "a+b"
  std::vector<BaseParameter> parameters;
  std::map<std::string, std::map<std::string, double>> fit;  // by set ("none": the base), all that is not neutral
  std::vector<Cell> where;
  ResidualMap map;
  SimulatorGap other;                                   // of another simulator, where one is given
  Forecast forecast;                                    // where a cause is named
  std::vector<std::string> separates;                   // what the next experiment would tell apart
  std::string next_experiment, next_session;            // in words, and as sections of a rig's configuration
  std::vector<std::string> doubts, remarks;             // doubts: of the recordings (capture/trial/doubts.h)
  std::vector<std::pair<std::string, double>> stage_s;  // wall time of each stage
  int cells = 0, fine_cells = 0;                        // of the grids, along the width
  BaseFit base_fit;                                     // of the base model
  int evaluations = 0;
  double wall_s = 0, cpu_s = 0;
};

}  // namespace selvedge::diagnose
