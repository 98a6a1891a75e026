// A blind check answered by a Slurm job array, one task a campaign.
//
// Each task is `PROGRAM blind answer DIR --campaign ID`. Answers become final here, once all are there.
#pragma once

#include <filesystem>

#include "report/progress.h"
#include "station/job_array.h"

namespace selvedge::cli {

// Submits what has no answer yet, waits, and returns how many are answered. `missing` is told of each campaign whose
// task left the queue without an answer, and why. Throws BadInput where the answers are final already, or sbatch
// refuses.
size_t answer_by_array(const std::filesystem::path& folder, const station::SlurmOptions& options,
                       const report::ProgressCallback& progress,
                       const std::function<void(const std::string& id, const std::string& why)>& missing);

}  // namespace selvedge::cli
