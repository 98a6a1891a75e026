#include "cli/shared_files.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;

fs::path installed_folder() {
  return fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "share" / "selvedge";
}

bool is_installed() { return fs::is_directory(installed_folder() / "examples"); }

}  // namespace

fs::path shared_folder() { return is_installed() ? installed_folder() : fs::path(SELVEDGE_SOURCE_DIR); }

fs::path console_web_folder() {
  return is_installed() ? installed_folder() / "console-web" : fs::path(SELVEDGE_CONSOLE_WEB);
}

}  // namespace selvedge::cli
