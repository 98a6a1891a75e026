// Markers and held corners of a mapping that names a C3D file (import_mapping.h).
#pragma once

#include <filesystem>

#include "capture/trial/trial.h"
#include "files/toml_file.h"

namespace selvedge::station {

// Fills in markers, corners and noise. Times count from the file's first frame. base: the mapping's folder. Throws
// BadInput naming the file or the key.
void read_c3d_parts(const files::TomlFile& mapping, const std::filesystem::path& base, trial::Trial& trial);

}  // namespace selvedge::station
