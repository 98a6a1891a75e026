#include "cli/verify/proofs/skirt_case.h"

#include <cmath>
#include <filesystem>
#include <string>

#include <unistd.h>

#include "files/whole_file.h"
#include "garment/synthetic_walk.h"

namespace selvedge::cli {

WornSkirt wear_walking_skirt(int triangles, double duration_s, const report::ProgressCallback& progress) {
  // Through a file, as a lab's own motion comes.
  const std::filesystem::path walk =
      std::filesystem::temp_directory_path() / ("selvedge_walk_" + std::to_string(::getpid()) + ".bvh");
  files::write_whole(walk, garment::synthetic_walk(duration_s));
  garment::Wearer wearer;
  wearer.motion = std::make_shared<const garment::Motion>(garment::read_bvh(walk));
  std::filesystem::remove(walk);
  wearer.limbs = garment::walker_limbs();

  const double waist_m = 0.72, hem_m = 1.6, length_m = 0.6, area = (waist_m + hem_m) / 2 * length_m;
  garment::Pattern pattern = garment::make_gored_skirt(4, waist_m, hem_m, length_m, std::sqrt(2 * area / triangles));
  pattern.fabric.density = 0.187;
  pattern.fabric.stretch = 69;
  pattern.fabric.shear = 33;
  pattern.held_above_m = 0.1;
  const garment::Garment skirt = garment::sew(pattern);
  return {static_cast<int>(skirt.surface.triangles.size()),
          garment::wear(pattern, skirt, wearer, {duration_s, 30, progress})};
}

}  // namespace selvedge::cli
