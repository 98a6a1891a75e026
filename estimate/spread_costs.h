// Costs of a search, computed on all ranks of an MPI job.
#pragma once

#include <functional>
#include <memory>

#include "estimate/optimisers/search.h"
#include "model/ranks/ranks.h"

namespace selvedge::estimate {

// Costs of which every rank computes a share. `remembered` (a journal's, say) stands around them on the first rank
// alone. Without ranks: remembered(costs).
BatchCosts spread_costs(const std::shared_ptr<model::Ranks>& ranks, const BatchCosts& costs,
                        const std::function<BatchCosts(BatchCosts)>& remembered);

}  // namespace selvedge::estimate
