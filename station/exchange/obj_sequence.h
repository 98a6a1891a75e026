// A fitted motion as Wavefront OBJ files, one a time: frame_00001.obj and on, with times.csv beside them.
// Vertices in m, motion-capture frame, z up; texture coordinates are the flat fabric, 0 to 1.
#pragma once

#include <filesystem>

#include "station/motion_file.h"

namespace selvedge::station {

// Returns how many files it wrote.
size_t write_obj_sequence(const SimulatedMotion& motion, const std::filesystem::path& folder);

}  // namespace selvedge::station
