// The folder that a command writes into, refused before hours of work rather than after them.
#pragma once

#include <filesystem>
#include <string>

namespace selvedge::cli {

// Throws BadInput "OPTION FOLDER: found a file …" where folder, or a part of its path, is a file. Folders that are not
// there yet may be made later. option: as on the command line, "--out".
void expect_folder(const std::string& option, const std::filesystem::path& folder);

}  // namespace selvedge::cli
