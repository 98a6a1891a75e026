// A file that somebody else's library writes: there whole or not at all.
#pragma once

#include <filesystem>
#include <functional>

namespace selvedge::files {

// Has `write` write PATH.part, then renames that to `path`; of a part that is not finished nothing is left. Throws
// BadInput naming the path where it is a folder, or where the folder that it is to lie in is not there; else what
// `write` throws, or std::runtime_error where the disk refuses.
void write_in_part(const std::filesystem::path& path, const std::function<void(const std::filesystem::path&)>& write);

}  // namespace selvedge::files
