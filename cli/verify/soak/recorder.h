// The recorder of `./selvedge soak`: trials one after another on a running rig, whatever happens to it, until it is
// ended. A process of its own, so that it can be killed.
#pragma once

#include <atomic>
#include <filesystem>

namespace selvedge::cli {

// world: for where camera and projector stand; a soak does not calibrate. trials: a folder for each trial goes there.
void record_trials(const std::filesystem::path& rig, const std::filesystem::path& world,
                   const std::filesystem::path& trials, const std::atomic<bool>& stopping);

}  // namespace selvedge::cli
