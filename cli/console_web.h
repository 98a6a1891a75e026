// Where the console's page lies.
#pragma once

#include <filesystem>

namespace selvedge::cli {

// As it was built: console-web among the files that are installed, or in the build folder.
std::filesystem::path console_web_folder();

}  // namespace selvedge::cli
