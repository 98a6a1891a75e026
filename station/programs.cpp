#include "station/programs.h"

#include <fmt/format.h>

#include "files/bad_input.h"
#include "files/shared_files.h"

namespace selvedge::station {

namespace fs = std::filesystem;

std::optional<fs::path> find_program(const std::string& name) {
  const fs::path folder = files::own_program().parent_path();
  std::error_code error;
  for (const fs::path& candidate : {folder / name, folder.parent_path() / "lib" / "selvedge" / name,
                                    folder.parent_path().parent_path() / "bin" / name})
    if (fs::is_regular_file(candidate, error)) return candidate;
  return std::nullopt;
}

fs::path program(const std::string& name) {
  const auto found = find_program(name);
  if (!found)
    refuse(name, "found no such program beside {}, expected it to be built or installed with it",
           files::own_program().string());
  return *found;
}

}  // namespace selvedge::station
