// An experiment from its data file to its figures.
//
//   1. record or read each fabric's trials, observe them, find where to start (fabric_case.h)
//   2. fit them by each optimiser of the file (identification.h)
//   3. predict what was not fitted, or every fabric's recording by every fabric's parameters (figure 14)
// A skirt is worn instead (worn_skirt.h).
//
// FOLDER: inputs.txt (what was asked for), trials/ (simulated recordings), fits/ (kept_fits.h), result.json,
// report.html.
#pragma once

#include "experiments/identification.h"
#include "experiments/worn_skirt.h"

namespace selvedge::experiments {

struct FabricOutcome {
  std::shared_ptr<const FabricCase> fabric;
  std::vector<size_t> fitted, predicted;   // trials
  Eigen::Index searched = 9;               // parameters
  std::vector<Identification> identified;  // one an optimiser
  // Error of the start, of each optimiser's set and, for a simulated fabric, of the truth (rows) in each predicted
  // trial.
  Eigen::MatrixXd prediction;
};

struct ExperimentOutcome {
  ExperimentFile file;
  bool quick = false;
  std::vector<FabricOutcome> fabrics;
  std::vector<Eigen::MatrixXd> cross;  // one an optimiser: rows recorded, columns simulated
  Repeats repeats;
  size_t repeated = 0;  // index of that fabric
  std::vector<SkirtOutcome> skirts;
  double wall_s = 0;
};

// Continues what a run of the same inputs left in `folder`. Throws BadInput for what the file or the trials lack, and
// where the folder holds another experiment; nothing is written then.
ExperimentOutcome run_experiment(const ExperimentFile& file, bool quick, const std::filesystem::path& folder,
                                 const report::ProgressCallback& progress);

// Every fabric's parameters beside every fabric's recording (figure 14); `optimiser` as an index into `identified`.
Eigen::MatrixXd cross_errors(const std::vector<FabricOutcome>& fabrics, size_t optimiser);

}  // namespace selvedge::experiments
