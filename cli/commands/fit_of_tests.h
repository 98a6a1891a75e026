// The fit of a campaign of material tests alone, as `fit` and `import --fit` run it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/trial/trial.h"

namespace selvedge::cli {

// Adds where a fabric of this rigidity (N·m) and mass (kg/m²) lies among those of the library. library_folder: empty:
// the user's own.
void add_place(std::vector<std::string>& remarks, double bend, double areal_mass,
               const std::filesystem::path& library_folder);

// Prints the answers, and writes OUT/fit.json and OUT/report.html.
void fit_tests_and_write(const trial::Campaign& campaign, const std::filesystem::path& library_folder,
                         const std::filesystem::path& out);

}  // namespace selvedge::cli
