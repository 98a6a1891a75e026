// An experiment's figures beside the paper's: as tables for a terminal, as result.json and as report.html.
#pragma once

#include <string>
#include <vector>

#include "experiments/run_experiment.h"

namespace selvedge::experiments {

struct ResultTable {
  std::string title;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
};

// The paper's columns stand to the right of ours.
std::vector<ResultTable> tables_of(const ExperimentOutcome& out);

// Tables of parameters, start to variability (tables 1 and 3), of one fabric and optimiser.
ResultTable parameter_table(const std::string& title, const FabricOutcome& f, const Identification& found,
                            const PaperTable& paper);
// Searches of one trial from starts close together (table 2).
ResultTable repeats_table(const std::string& title, const FabricOutcome& f, const Repeats& repeats,
                          const PaperTable& paper);
ResultTable cross_table(const std::string& title, const std::vector<FabricOutcome>& fabrics,
                        const Eigen::MatrixXd& matrix);

// Recordings that their own fabric's parameters explain best.
int own_wins(const Eigen::MatrixXd& matrix);

// What a reader should know beside the tables, a sentence each.
std::vector<std::string> remarks_of(const ExperimentOutcome& out);

// result.json and report.html in `folder`.
void write_experiment(const ExperimentOutcome& out, const std::filesystem::path& folder);

}  // namespace selvedge::experiments
