// Parameters of one fabric from its trials, as the paper of 2003 finds them (a search of each trial by itself, the set
// with the least summed error chosen) or by least squares over all trials at once; and what is known of them.
#pragma once

#include "experiments/fabric_case.h"
#include "experiments/kept_fits.h"

namespace selvedge::experiments {

// What one optimiser made of a fabric's trials.
struct Identification {
  std::string optimiser;
  std::vector<std::string> labels;  // of the sets: "exp 1", "exp 2" or "together"
  std::vector<OneFit> fits;         // one a set
  Eigen::MatrixXd error;            // rows: start, then one a set; columns: trials
  size_t chosen = 0;                // set with the least sum
  std::vector<double> variability;  // of each searched parameter at the chosen set, %; infinite where unseen
  const Eigen::VectorXd& set() const { return fits[chosen].set; }
  double chosen_error() const { return error.row(static_cast<Eigen::Index>(chosen) + 1).sum(); }
  double wall_s() const;
};

struct IdentificationOptions {
  std::string optimiser = "annealing";
  int evaluations = 600;  // of a search, a trial
  int iterations = 25;    // of least squares, at most
  unsigned seed = 1;
  report::ProgressCallback progress = [](double, const std::string&) {};
};

// Searches over the first `searched` parameters; the others stay at the start.
Identification identify(const FabricCase& c, const std::vector<size_t>& trials, Eigen::Index searched,
                        const IdentificationOptions& options, const KeptFits& kept);

// Table 2: searches of one trial from starts within ±5 % of the case's. Row k of the last column is its error.
struct Repeats {
  std::vector<OneFit> fits;
  std::vector<double> error;
};
Repeats repeat(const FabricCase& c, size_t trial, Eigen::Index searched, int times,
               const IdentificationOptions& options, const KeptFits& kept);

}  // namespace selvedge::experiments
