#include "files/part_file.h"

#include <system_error>

#include "files/bad_input.h"

namespace selvedge::files {

namespace fs = std::filesystem;

void write_in_part(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  if (fs::is_directory(path)) refuse(path.string(), "found a folder, expected a file to write");
  const fs::path folder = fs::absolute(path).parent_path();
  if (!fs::is_directory(folder)) refuse(path.string(), "found no folder {}, expected it to be there", folder.string());
  const fs::path unfinished = path.string() + ".part";
  try {
    write(unfinished);
    fs::rename(unfinished, path);
  } catch (...) {
    std::error_code ignored;
    fs::remove(unfinished, ignored);
    throw;
  }
}

}  // namespace selvedge::files
