// One simulated fabric of the paper of 2003, recorded, observed and ready to be fitted: by annealing of the fold
// metric's E, a trial at a time as the paper does, and by least squares over its waving trials together.
#pragma once

#include <memory>

#include "cli/proofs/fabric_trials.h"
#include "fit/fold_objective.h"
#include "fit/least_squares.h"

namespace selvedge::cli {

struct CaseOptions {
  int columns = 11;           // of the mesh, recorded and fitted alike
  int coarse_columns = 9;
  double frame_rate_hz = 15;  // of the frames compared
  int frames = 18;
  unsigned seed = 1;
};

// In campaign order: static-1, static-2, waving-1, waving-2.
struct FabricCase {
  TrueFabric truth;
  trial::Campaign campaign;
  std::vector<fit::Parameter> parameters;     // the nine of the base model
  Eigen::VectorXd true_coordinates, start;    // start: best of the coarse grid
  std::unique_ptr<fit::Objective> scenes;
  std::vector<fit::FoldTrack> tracks;
  std::unique_ptr<fit::FoldObjective> folds;
};

std::unique_ptr<FabricCase> prepare_case(const TrueFabric& fabric, const std::filesystem::path& folder, const CaseOptions& options);

// E per frame of whole parameter sets (columns) in each of the trials (columns of the result).
Eigen::MatrixXd energies(const FabricCase& c, const Eigen::MatrixXd& sets, const std::vector<size_t>& trials);

// E of this fabric's parameters and density, beside the recording of another fabric.
double energy_beside(const FabricCase& recorded, const FabricCase& simulated, const Eigen::VectorXd& set, const std::vector<size_t>& trials);

struct TimedFit {
  Eigen::VectorXd set;       // all nine coordinates
  double wall_s = 0;
  int evaluations = 0;
};

// Annealing over the first `searched` parameters on one trial; the others stay at `start`.
TimedFit anneal_case(const FabricCase& c, size_t trial, Eigen::Index searched, const Eigen::VectorXd& start, int evaluations, unsigned seed);

// Least squares over trials together; `sd` gets the standard deviation of each coordinate.
TimedFit least_squares_case(const FabricCase& c, const std::vector<size_t>& trials, Eigen::VectorXd& sd);

// The paper's variability of the first `searched` parameters over trials together, %.
std::vector<double> case_variability(const FabricCase& c, const std::vector<size_t>& trials, Eigen::Index searched, const Eigen::VectorXd& set);

}  // namespace selvedge::cli
