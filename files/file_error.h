// A file that the system would not let us write or read.
#pragma once

#include <filesystem>

namespace selvedge::files {

// Throws std::runtime_error "PATH: STEP: what the system says of that number".
[[noreturn]] void fail(const std::filesystem::path& path, const char* step, int error_number);

}  // namespace selvedge::files
