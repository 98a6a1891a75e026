// Pages that a test wrote, for whoever looks at all of them in a browser (tests/report/pages.sh).
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace selvedge {

// A copy as NAME.html in the folder that SELVEDGE_PAGES names; nothing where it names none.
inline void keep_page(const std::filesystem::path& page, const std::string& name) {
  const char* folder = std::getenv("SELVEDGE_PAGES");
  if (folder == nullptr) return;
  std::filesystem::create_directories(folder);
  std::filesystem::copy_file(page, std::filesystem::path(folder) / (name + ".html"),
                             std::filesystem::copy_options::overwrite_existing);
}

}  // namespace selvedge
