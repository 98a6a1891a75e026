// One experiment of Bhat et al. 2003 as a data file (TOML): which fabrics, which trials, how they are fitted, and what
// the paper printed of it. docs/experiments.md lists every key.
//
//   [experiment]  kind = "static" … "skirt", title, fabrics, fabric_file
//   [fabric.NAME] SI parameters of a simulated fabric, or campaign = "folder" of recorded trials
//   [trials]      how simulated trials are recorded; names = […], one [trials.NAME] each
//   [fit]         optimisers, error, evaluations, mesh, frames
//   [skirt]       pattern, motion, spacing
//   [paper]       source, columns; one [paper.NAME] a fabric, its cells as printed
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/trial/trial.h"
#include "cloth/material.h"

namespace selvedge::experiments {

enum class Kind { static_hang, waving, robot, cross, generalisation, skirt };
const char* to_text(Kind kind);

// A fabric: simulated, or recorded where `campaign` names a folder.
struct Fabric {
  std::string name;
  cloth::Material material;
  std::filesystem::path campaign;
  bool recorded() const { return !campaign.empty(); }
};

// One simulated trial: corners apart_m apart; the right one moves by amplitude_m at frequency_hz.
struct TrialPlan {
  std::string name;
  trial::Experiment kind = trial::Experiment::static_hang;
  double apart_m = 0.29, amplitude_m = 0, frequency_hz = 0;
  int frames = 0;  // 0: the protocol's
};

struct TrialProtocol {
  double size_m = 0.3;  // of the square sheet
  int cells = 16;       // along the width of the sheet that is recorded
  int frames = 50;      // of a moving trial; a still one has one
  double frame_rate_hz = 30;
  double noise_grey = 1.5, noise_m = 2e-4;  // standard deviations of a pixel and of a corner's coordinate
  unsigned seed = 1;
  std::vector<TrialPlan> trials;
};

// folds: E of the fold metric per frame (needs images). residuals: root mean square distance, mm.
enum class ErrorKind { folds, residuals };

struct FitPlan {
  std::vector<std::string> optimisers = {
      "annealing"};  // "least_squares", or as estimate/optimisers/registry.h names them
  ErrorKind error = ErrorKind::folds;
  int evaluations = 600;  // of a search, a trial
  int iterations = 25;    // of least squares, at most
  int cells = 12, coarse_cells = 8;
  int frames = 50;              // of each moving trial; later ones are held out
  double frame_rate_hz = 30;    // frames compared
  bool from_grid = true;        // start: best of a coarse grid; otherwise each parameter's usual value
  int repeats = 0;              // of the first trial from starts within ±5 % (table 2)
  std::string repeated_fabric;  // of which fabric; empty: the first
  unsigned seed = 1;
};

struct SkirtPlan {
  std::filesystem::path pattern, motion;  // motion empty: the pattern's own
  double spacing_m = 0.02, seconds = 4, frames_per_s = 30;
};

// Cells as printed: rows by name, one text a column.
using PaperRows = std::map<std::string, std::vector<std::string>>;

struct PaperTable {
  std::string source;
  std::vector<std::string> columns;
  std::map<std::string, PaperRows> fabrics;
  std::vector<std::string> repeated_columns;
  PaperRows repeated;
  std::string remark;
};

struct ExperimentFile {
  std::filesystem::path path;
  Kind kind = Kind::static_hang;
  std::string title;
  std::vector<Fabric> fabrics;
  TrialProtocol protocol;
  FitPlan fit;
  SkirtPlan skirt;
  PaperTable paper;
};

// Throws BadInput naming file and key: unknown keys, values out of range, fabrics or trials that are named and not
// described, trials that the kind of experiment cannot do without.
ExperimentFile read_experiment(const std::filesystem::path& path);

// The fabrics of `path` replaced by recorded ones: folders of campaigns, each with its fabric's name.
void use_campaigns(ExperimentFile& file, const std::vector<std::filesystem::path>& campaigns);

// The same in a minute or less: first and last fabric, a coarse mesh, few frames and evaluations.
ExperimentFile quick_version(ExperimentFile file);

// The trials that an experiment fits, and those that it only predicts.
bool is_fitted(Kind kind, trial::Experiment trial);
bool is_predicted(Kind kind, trial::Experiment trial);

}  // namespace selvedge::experiments
