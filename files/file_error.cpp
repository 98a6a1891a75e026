#include "files/file_error.h"

#include <cstring>
#include <stdexcept>

#include <fmt/format.h>

namespace selvedge::files {

void fail(const std::filesystem::path& path, const char* step, int error_number) {
  throw std::runtime_error(fmt::format("{}: {}: {}", path.string(), step, std::strerror(error_number)));
}

}  // namespace selvedge::files
