// Where the files lie that come with Selvedge: data/ and examples/.
#pragma once

#include <filesystem>
#include <optional>

namespace selvedge::files {

// Path of the program that runs now.
std::filesystem::path own_program();

// share/selvedge of the prefix where that is installed, in bin/ or lib/selvedge/; nullopt where it is not.
std::optional<std::filesystem::path> installed_folder();

// That folder, the source folder otherwise.
std::filesystem::path shared_folder();

// A path as a rig's file has it: as it stands where it leads to something; else, where it is relative, as it lies in
// the shared folder, so that a copied example finds data/arms/ur5e.toml from wherever it is used.
std::filesystem::path or_shared(const std::filesystem::path& path);

}  // namespace selvedge::files
