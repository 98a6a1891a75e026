#include "cli/shared_files.h"

#include "station/programs.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;

// Of a program in PREFIX/bin or PREFIX/lib/selvedge; empty: this one is not installed.
fs::path installed_folder() {
  const fs::path folder = station::own_program().parent_path().parent_path();
  for (const fs::path& prefix : {folder, folder.parent_path()})
    if (fs::is_directory(prefix / "share" / "selvedge" / "examples")) return prefix / "share" / "selvedge";
  return {};
}

}  // namespace

fs::path shared_folder() {
  const fs::path installed = installed_folder();
  return installed.empty() ? fs::path(SELVEDGE_SOURCE_DIR) : installed;
}

fs::path console_web_folder() {
  const fs::path installed = installed_folder();
  return installed.empty() ? fs::path(SELVEDGE_CONSOLE_WEB) : installed / "console-web";
}

}  // namespace selvedge::cli
