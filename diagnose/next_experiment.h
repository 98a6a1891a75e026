// What to record next so that the effects that are still confusable come apart.
//
// Candidates are trials that the rig can run (faster or slower, corners nearer together or further apart, the swatch
// turned by 90° or over, a weight, a longer hang). Each is simulated under the two likeliest hypotheses at
// their fitted values; the one whose markers differ most, beyond what the sensor and the mesh leave open, is proposed.
// Where none does, the likeliest and the next one are tried, and so on; in the end it is said that none does.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "diagnose/study.h"

namespace selvedge::diagnose {

// A set of effects at its estimate.
struct PredictedSet {
  std::string name;                      // "none", "a", "a+b"
  model::State branches;                 // of equilibrium there
  Eigen::VectorXd x;                     // all coordinates
  std::vector<Eigen::VectorXd> without;  // a group of trials: found without it
};

struct NextExperiment {
  std::vector<std::string> separates;  // two names, or none
  std::string what;                    // in words
  std::string session;                 // what a session changes: frequency, separation, flip, turn, weight
  std::string like_trial;              // the trial that it varies
  std::string session_toml;            // sections for the rig's configuration, as capture/session reads them
  double predicted_mm = 0;             // how far the two predictions lie apart
  double present_mm = 0;               // in the trials at hand
};

// Of those whose name has a probability.
NextExperiment propose_experiment(const Study& study, const std::vector<PredictedSet>& sets,
                                  const std::map<std::string, double>& probability);

// A motion that was not recorded, as the base model and the corrected one tell it.
struct Forecast {
  std::string motion;      // in words; empty: nothing moves, or what moves faster diverges
  std::string like_trial;  // the trial that it varies
  double speed = 1;        // times that trial's
  double moving_s = 0;     // from its held points' first move on: as long as that trial was looked at
  double before_mm = 0;    // error that the base model will have
  // 90 %, jackknife over groups of trials of what the base lacks, so no less than after_mm; NaN where one diverges
  double low_mm = 0, high_mm = 0;
  double after_mm = 0;  // error that the corrected one will have: what it leaves of held-out trials
};

// named_left_mm: of held-out trials.
Forecast forecast(const Study& study, const PredictedSet& base, const PredictedSet& named, double named_left_mm);

}  // namespace selvedge::diagnose
