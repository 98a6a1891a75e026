// Where the files lie that come with Selvedge: data/, examples/ and the console's page.
#pragma once

#include <filesystem>

namespace selvedge::cli {

// The folder that holds data/ and examples/: share/selvedge of the prefix where the program is
// installed, the source folder otherwise.
std::filesystem::path shared_folder();

// The console's page as it was built: console-web there, or in the build folder.
std::filesystem::path console_web_folder();

}  // namespace selvedge::cli
