// Diagnosing a campaign: where the gap between recording and base model lies, what it is fixed to, which effect
// closes it, how far, and what to record next.
//
//   1. base      fit the base model, with what a finer grid adds (study.h)
//   2. screen    change every effect by a finite size; keep what a refit of the base does not absorb
//   3. refit     every effect together with the base; the best few on the fine grid as well
//   4. hold out  predict each group of trials from the others, with and without each effect
//   5. judge     probabilities, confusable set, gap reduction, size (verdict.h); two effects where one does not suffice
//   6. ahead     how far the gap shrinks, in predictions for a quarter of a second (ahead.h)
//   7. free      the gap, without nudging towards the markers that steps 1 to 5 have (cloth/guide.h)
//   7. where     the base's residual split by region, time, frequency, regime and image row (where.h)
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "diagnose/effects/effect.h"
#include "diagnose/next_experiment.h"
#include "diagnose/base_fit.h"
#include "diagnose/study.h"
#include "diagnose/verdict.h"
#include "diagnose/where.h"

namespace selvedge::diagnose {

struct DiagnosisOptions {
  StudyOptions study;
  std::function<void(const BaseFit&)> on_base_fit;  // called once it is there
};

struct SizedParameter {
  std::string name, unit;
  double value = 0, low = 0,
         high = 0;  // 90 %: jackknife over groups of trials, and Protocol::rig_size_share or fabric_size_share
};

struct GapReduction {
  double before_mm = 0, after_mm = 0, fraction = 0, low = 0,
         high = 0;        // 90 % for as many trials again, jackknife over groups; NaN where there is one group
  bool is_ahead = false;  // told of predictions Protocol::ahead_s ahead, else of motions that run free
};

// What is known of one effect.
struct EffectFinding {
  std::string name, summary;
  Side side = Side::elastic;
  double absorbed = 0;       // share of its trace in the data that a refit of the base takes up
  double screened_gain = 0;  // share of the base's squared residual that it explains beyond that, linearly
  bool finalist = false;
  std::vector<SizedParameter> size;
  GapReduction
      reduction;  // of motions that run free where no markers were seen, or where the effect is that of the grid
  GapReduction free_reduction;  // of motions that run free
  double probability = 0;
};

struct BaseParameter {
  std::string name, unit;
  double value = 0, corrected = 0;  // alone, and with the named cause added
};

// What each hypothesis left of groups of trials that it was not fitted to, mm: what the probabilities were made of.
struct Judged {
  std::vector<std::string> groups;                  // the first trial of each
  std::vector<double> noise;                        // what the sensor alone leaves
  std::vector<double> right_model;                  // what a right model is expected to leave
  std::map<std::string, std::vector<double>> left;  // by hypothesis; the base is "none"
};

struct Diagnosis {
  Protocol protocol;
  std::string campaign, base;
  double gap_mm = 0, low_mm = 0, high_mm = 0, noise_floor_mm = 0, right_floor_mm = 0, replicate_mm = 0, p_value = 1;
  double before_mm = 0;
  std::string side, cause;
  std::map<std::string, double> probability;
  std::vector<std::string> confusable;
  std::vector<std::string> cannot_tell;  // effects whose trace a refit of the base absorbs
  std::vector<EffectFinding> effects;    // by probability
  std::string pair;  // "a+b" where two effects at once are likelier than any one, none and unknown, else empty
  double pair_probability = 0;  // the two share it in `probability`, half and half
  GapReduction pair_reduction;
  std::vector<BaseParameter> parameters;
  Judged judged;
  std::map<std::string, std::map<std::string, double>> fit;  // by hypothesis ("none": the base), parameters
  std::map<std::string, std::map<std::string, double>>
      free_fit;  // by hypothesis ("none": the base), parameters refitted to free motions
  std::vector<Cell> where;
  ResidualMap map;
  Forecast forecast;                          // where a cause is named
  std::vector<std::string> separates;         // what the next experiment would tell apart
  std::string next_experiment, next_session;  // in words, and as sections of a rig's configuration
  std::vector<std::string> remarks;
  std::vector<std::pair<std::string, double>> stage_s;  // wall time of each stage
  int cells = 0, fine_cells = 0;                        // of the grids, along the width
  BaseFit base_fit;                                     // of the base model
  int evaluations = 0;
  double wall_s = 0, cpu_s = 0;
};

// Goes on from the base fit that `file` holds of this campaign, these settings and this code, and keeps it there once
// it is found.
void keep_base_fit(DiagnosisOptions& options, const std::filesystem::path& file, const trial::Campaign& campaign);

// Begins with the parameters of the campaign's fit.json, where one of the folders has one of this very campaign and
// drag law. Returns its path, or nothing.
std::optional<std::filesystem::path> begin_with_fit(DiagnosisOptions& options, const trial::Campaign& campaign,
                                                    const std::vector<std::filesystem::path>& folders);

Diagnosis diagnose(const trial::Campaign& campaign, const std::vector<Effect>& effects,
                   const DiagnosisOptions& options = {});

}  // namespace selvedge::diagnose
