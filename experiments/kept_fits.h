// Fits of an experiment on disk, so that an experiment killed at any time continues: a finished fit is read again, a
// search that was under way goes on after its last evaluation.
//
// FOLDER/NAME.json holds a finished fit, FOLDER/NAME.evaluations.txt the journal of a search
// (estimate/optimisers/journal.h). Both open with what was fitted; those of other inputs are refused.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <Eigen/Core>

#include "estimate/optimisers/search.h"

namespace selvedge::experiments {

struct OneFit {
  Eigen::VectorXd set;  // all coordinates
  Eigen::VectorXd sd;   // standard deviation of each, with what rival valleys leave open; of least squares alone
  double wall_s = 0;    // of the run that finished it
  int evaluations = 0;
  int from_journal = 0;                     // of these, known from an earlier run
  std::vector<estimate::SearchStep> trace;  // of a search
};

class KeptFits {
 public:
  // An empty folder: nothing is kept.
  explicit KeptFits(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // The fit of that name if it is there, or what `compute` gives. identity: one line, everything that makes it another
  // fit.
  OneFit get(const std::string& name, const std::string& identity, const std::function<OneFit()>& compute) const;

  // Runs a search with its journal.
  estimate::SearchResult search(const std::string& name, const std::string& identity, const std::string& optimiser,
                                estimate::SearchProblem problem, const estimate::SearchLimits& limits,
                                int& from_journal) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace selvedge::experiments
