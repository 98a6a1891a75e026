// Markers, or a scanned surface, of a mapping that names files of points (import_mapping.h): a file a frame, or an NPY
// of all.
#pragma once

#include <filesystem>
#include <vector>

#include "capture/trial/trial.h"
#include "files/toml_file.h"
#include "station/exchange/import_units.h"

namespace selvedge::station {

// The files of a folder but hidden ones, by their names; numbers in them count by their value, so that f9 comes before
// f10.
std::vector<std::filesystem::path> files_in_order(const std::filesystem::path& folder);

// A marker's number is its point's place in the file. base: the mapping's folder; trial.fabric is read already, and
// mocap_noise_m is set. Throws BadInput naming the file or the key.
trial::Markers read_point_markers(files::Section keys, const std::filesystem::path& base, const Units& units,
                                  trial::Trial& trial);

// Clouds whose points are others in every frame. seen_from_m: in the tracker's frame, m. Throws BadInput naming the
// file or the key.
trial::Surface read_surface(files::Section keys, const std::filesystem::path& base, const Units& units);

}  // namespace selvedge::station
