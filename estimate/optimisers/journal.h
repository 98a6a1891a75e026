// Every evaluation of a search, on disk as soon as it is known, so that a search killed at any time continues.
//
// A search is deterministic, so the continued one asks for the same points again; those in the journal are
// answered from it, the first that is not goes on to the costs. Text: a first line that says what was
// searched, then one line an evaluation, the point's coordinates and its cost with commas between, each number in
// the shortest form that reads back as the same bits.
#pragma once

#include <filesystem>
#include <string>
#include <unordered_map>

#include "estimate/optimisers/journal_file.h"
#include "estimate/optimisers/search.h"

namespace selvedge::estimate {

class Journal {
 public:
  // Continues the file if it is there. identity: one line that says what is searched (trials, parameters, optimiser,
  // seed, budget). Throws BadInput where the file is of another search or a line is not one of its own.
  Journal(const std::filesystem::path& path, const std::string& identity);

  // Costs that ask the journal first and write what it did not know. The journal must outlive them.
  BatchCosts recorded(BatchCosts costs);

  size_t known() const { return cost_of_.size(); }
  size_t found() const { return found_; }  // when it was opened

 private:
  std::vector<double> costs_of(const Eigen::MatrixXd& points, const BatchCosts& costs);

  std::unordered_map<std::string, double> cost_of_;  // by the point's text
  JournalFile file_;
  size_t found_ = 0;
};

}  // namespace selvedge::estimate
