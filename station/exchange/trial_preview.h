// The page that shows what was imported: whether axes, units and clocks were taken for others can be seen at a glance.
//
// Markers and held corners from the front and from the side at the first, middle and last time, the flat swatch hung
// from the corners beside them, gravity as an arrow; the first, middle and last picture; rates and clocks; every doubt
// of capture/trial/doubts.h as a line.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/trial/trial.h"

namespace selvedge::station {

// SVG: how markers and corners hang at the first, the middle and the last time of markers. Empty where there are none.
std::vector<std::string> hanging_pictures(const trial::Trial& trial);

// Of a fabric that hangs from a rig. Throws BadInput where a picture cannot be read.
void write_preview(const trial::Trial& trial, const std::filesystem::path& page);

}  // namespace selvedge::station
