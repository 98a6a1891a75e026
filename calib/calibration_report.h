// report.html of a calibration: verdict, figures, residual vectors, bars per pose and marker, map of the
// predicted deviation at the fabric, coverage, and the next pose that would help most. px, mm.
#pragma once

#include <filesystem>

#include "calib/calibration.h"

namespace selvedge::calib {

void write_report(const Calibration& calibration, const std::filesystem::path& path);

}  // namespace selvedge::calib
