// A disk of a few hundred megabytes of memory that this process and its children see, so that it can be filled up.
#pragma once

#include <cstddef>
#include <filesystem>

namespace selvedge::cli {

// Call before the process has threads. False where the kernel does not let this user mount anything.
bool mount_small_disk(const std::filesystem::path& folder, size_t bytes);

// Fills what is free with one file, or takes that file away.
void fill_disk(const std::filesystem::path& folder);
void clear_disk(const std::filesystem::path& folder);

}  // namespace selvedge::cli
