#include "files/shared_files.h"

namespace selvedge::files {

namespace fs = std::filesystem;

fs::path own_program() { return fs::read_symlink("/proc/self/exe"); }

std::optional<fs::path> installed_folder() {
  const fs::path folder = own_program().parent_path().parent_path();
  for (const fs::path& prefix : {folder, folder.parent_path()})
    if (fs::is_directory(prefix / "share" / "selvedge" / "examples")) return prefix / "share" / "selvedge";
  return std::nullopt;
}

fs::path shared_folder() { return installed_folder().value_or(fs::path(SELVEDGE_SOURCE_DIR)); }

fs::path or_shared(const fs::path& path) {
  std::error_code error;
  if (path.is_absolute() || fs::exists(path, error)) return path;
  const fs::path shared = shared_folder() / path;
  return fs::exists(shared, error) ? shared : path;
}

}  // namespace selvedge::files
