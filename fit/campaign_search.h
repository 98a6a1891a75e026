// A campaign fitted by one of the optimisers that need costs alone (estimate/optimisers), in the place of least
// squares.
//
// The search starts where least squares would, and runs on the final grid. Its error is either `residuals`, the robust
// cost in whitened millimetres that least squares minimise, or `folds`, E of the fold metric per frame, summed over the
// trials (Bhat et al. 2003). Every evaluation goes to a journal in the fit's folder: the same fit into the same folder
// continues after the last of them. What comes before the search is not in the journal and runs again.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "fit/fit_outcome.h"

namespace selvedge::fit {

enum class SearchError { residuals, folds };

struct CampaignSearch {
  std::string optimiser = "annealing";  // as estimate/optimisers/registry.h names them
  SearchError error = SearchError::residuals;
  std::vector<std::string> parameters;  // searched; the others stay at the start. Empty: all
  int evaluations = 600;
  unsigned seed = 1;
};

// `options` with the search in them. The campaign must outlive them. Throws BadInput where optimiser or a parameter is
// not known, or where the journal in `folder` (evaluations.txt) is another fit's.
FitOptions with_search(FitOptions options, const CampaignSearch& search, const trial::Campaign& campaign,
                       const std::filesystem::path& folder);

}  // namespace selvedge::fit
