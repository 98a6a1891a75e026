#include "cli/output_folder.h"

#include <system_error>

#include "files/bad_input.h"

namespace selvedge::cli {

namespace fs = std::filesystem;

void expect_folder(const std::string& option, const fs::path& folder) {
  std::error_code error;
  for (fs::path part = folder; !part.empty(); part = part.parent_path()) {
    const fs::file_status found = fs::status(part, error);
    if (fs::exists(found) && !fs::is_directory(found))
      refuse(option + " " + folder.string(), "found a file{}, expected a folder",
             part == folder ? "" : " at " + part.string());
    if (part == part.parent_path()) break;  // the root is its own parent
  }
}

}  // namespace selvedge::cli
