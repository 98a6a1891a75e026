// A small trial on disk, by our own writers: four frames of 8x4 px, corners, markers, robot.
#pragma once

#include <filesystem>

namespace selvedge::fuzz {

// checked: with checksums, as the recorder writes it; else as an import does.
void write_example_trial(const std::filesystem::path& folder, bool checked);

}  // namespace selvedge::fuzz
