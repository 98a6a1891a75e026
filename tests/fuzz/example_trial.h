// A small trial on disk, by our own writers: four frames of 8x4 px, corners, markers, robot.
#pragma once

#include <filesystem>

namespace selvedge::fuzz {

// checked: with checksums, as the recorder writes it; else as an import does.
void write_example_trial(const std::filesystem::path& folder, bool checked);

// The tables of material tests, and a trial of each: a strip over an edge, a disc on a support, a strip pulled.
inline constexpr const char* kMaterialTables[] = {"midline.csv", "outline.csv", "pull.csv"};
void write_material_test(const std::filesystem::path& folder, size_t which);

}  // namespace selvedge::fuzz
