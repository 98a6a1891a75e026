#include "garment/wearer_file.h"

#include "files/bad_input.h"
#include "files/json_reader.h"

namespace selvedge::garment {

Wearer read_wearer(const std::filesystem::path& path, const std::filesystem::path& other_motion) {
  const files::JsonReader json(path);
  BvhOptions options;
  std::filesystem::path file = other_motion;
  if (json.has("motion")) {
    const files::JsonReader motion = json.child("motion");
    motion.allow_only({"file", "metres_per_unit", "up", "dressing_s"});
    if (motion.has("metres_per_unit")) options.metres_per_unit = motion.positive("metres_per_unit");
    if (motion.has("up")) options.y_up = motion.choice("up", {"y", "z"}) == 0;
    if (file.empty()) file = path.parent_path() / motion.text("file");
  }
  if (file.empty()) refuse(json.where("motion"), "found no such key, expected it or --motion");
  Wearer wearer;
  wearer.motion = std::make_shared<const Motion>(read_bvh(file, options));
  if (json.has("motion")) wearer.dressing_s = json.child("motion").not_negative_or("dressing_s", wearer.dressing_s);
  if (!json.has("limbs")) wearer.limbs = limbs_of_skeleton(*wearer.motion);
  else
    for (const files::JsonReader& limb : json.children("limbs")) {
      limb.allow_only({"from", "to", "radius_m"});
      wearer.limbs.push_back({limb.text("from"), limb.text("to"), limb.positive("radius_m")});
    }
  return wearer;
}

}  // namespace selvedge::garment
