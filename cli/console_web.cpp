#include "cli/console_web.h"

#include "files/shared_files.h"

namespace selvedge::cli {

std::filesystem::path console_web_folder() {
  const auto installed = files::installed_folder();
  return installed ? *installed / "console-web" : std::filesystem::path(SELVEDGE_CONSOLE_WEB);
}

}  // namespace selvedge::cli
