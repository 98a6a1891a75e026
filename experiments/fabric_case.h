// One fabric's trials, observed and ready to be fitted.
#pragma once

#include <memory>
#include <optional>

#include "experiments/experiment_file.h"
#include "fit/fold_objective.h"
#include "estimate/least_squares.h"

namespace selvedge::experiments {

// Trials as simulated on one mesh and compared with what was seen of them.
struct Comparison {
  std::unique_ptr<const model::Simulation> scenes;
  model::State state;
  std::vector<fit::FoldTrack> tracks;  // where the error is of folds
  std::unique_ptr<fit::FoldObjective> folds;
};

struct FabricCase {
  Fabric fabric;
  trial::Campaign campaign;
  ErrorKind error = ErrorKind::folds;
  double density = 0;                          // kg/m²
  std::vector<model::Parameter> parameters;    // the nine of the base model
  std::optional<Eigen::VectorXd> truth;        // coordinates, where the fabric is simulated
  Eigen::VectorXd start;                       // of the coarse grid, or usual values
  std::vector<model::ObservedTrial> observed;  // the frames that are fitted
  int coarse_cells = 8;
  Comparison fitted;
  Comparison later;      // frames after those; without scenes where no trial has any
  double cut_s = 1e300;  // between the two
};

// Of a recorded campaign or of one that record_fabric made. What `kind` only predicts is neither cut after the frames
// that are fitted nor looked at for the start. Throws BadInput where it holds nothing to fit, or no images
// where the error is of folds.
std::unique_ptr<FabricCase> prepare_case(
    const Fabric& fabric, const trial::Campaign& campaign, Kind kind, const FitPlan& plan,
    const report::ProgressCallback& progress = [](double, const std::string&) {});

// Trials of one kind, as indices into the campaign.
std::vector<size_t> trials_of(const FabricCase& c, trial::Experiment kind);

// Whether a trial has frames after those that are fitted.
bool goes_on(const FabricCase& c, size_t trial);

// Error of whole parameter sets (columns) in each of the trials (columns of the result): E per frame, or mm. Infinity
// where a simulation diverged.
Eigen::MatrixXd errors(const FabricCase& c, const Eigen::MatrixXd& sets, const std::vector<size_t>& trials);
Eigen::MatrixXd later_errors(const FabricCase& c, const Eigen::MatrixXd& sets, const std::vector<size_t>& trials);

// Sum over the trials of the error that another fabric's parameters and density have beside this one's recording.
double error_beside(const FabricCase& recorded, const FabricCase& simulated, const Eigen::VectorXd& set,
                    const std::vector<size_t>& trials);

// Sum of the errors over the trials as a function of the first rows of a set, the others held.
estimate::BatchCosts costs_of_first(const FabricCase& c, const std::vector<size_t>& trials, Eigen::Index searched,
                                    const Eigen::VectorXd& held);

}  // namespace selvedge::experiments
