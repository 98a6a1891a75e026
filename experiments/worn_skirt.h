// The skirt of the paper's figure 16: one garment on one recorded motion, in each fabric.
#pragma once

#include <string>
#include <vector>

#include "experiments/experiment_file.h"
#include "garment/wear.h"
#include "report/progress.h"

namespace selvedge::experiments {

struct SkirtScene {
  garment::Pattern pattern;
  garment::Wearer wearer;
};

// Throws BadInput where pattern or motion cannot be worn.
SkirtScene read_skirt_scene(const SkirtPlan& plan);

struct SkirtOutcome {
  std::string fabric;
  size_t triangles = 0, frames = 0;
  int frames_that_intersect = 0;
  double largest_strain = 0, deepest_in_body_m = 0;
  double hem_width_m = 0;  // twice the hem's mean distance from its middle, mean over the motion
  double simulated_s = 0, wall_s = 0;
  bool finite = true;
  std::vector<std::string> pictures;  // PNG, evenly over the motion
  std::vector<double> picture_s;
};

// One after the other; each fabric's figures and pictures are kept in `folder` and not simulated again.
std::vector<SkirtOutcome> wear_skirts(const SkirtScene& scene, const SkirtPlan& plan,
                                      const std::vector<Fabric>& fabrics, const std::filesystem::path& folder,
                                      const report::ProgressCallback& progress);

}  // namespace selvedge::experiments
