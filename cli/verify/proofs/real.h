// The rows of `./selvedge prove real`: each takes a folder of ../shared/real, which lies outside the project.
#pragma once

#include <filesystem>
#include <vector>

#include "cli/verify/figures.h"

namespace selvedge::cli {

// 618 fabrics of a drape tester: strips simulated with their rigidities, and fitted again.
std::vector<Figure> prove_real_bending(const std::filesystem::path& folder, const FigureOptions& options);

// Knits pulled both ways: one orthotropic law, fitted to three pulls a direction, predicts the others.
std::vector<Figure> prove_real_tensile(const std::filesystem::path& folder, const FigureOptions& options);

// Five fabrics draped over a support: fitted to half of the samples, the others' drape coefficient predicted.
std::vector<Figure> prove_real_cusick(const std::filesystem::path& folder, const FigureOptions& options);

// A cloth that a robot arm swings: three recordings predict the other three, in units of the nodes' noise.
std::vector<Figure> prove_real_arm_cloth(const std::filesystem::path& folder, const FigureOptions& options);

// The same cloth with both clocks as they were recorded: the camera's delay.
std::vector<Figure> prove_real_arm_cloth_raw(const std::filesystem::path& folder, const FigureOptions& options);

}  // namespace selvedge::cli
