#include "experiments/worn_skirt.h"

#include <algorithm>

#include <fmt/format.h>

#include "files/json_reader.h"
#include "files/whole_file.h"
#include "garment/pictures.h"
#include "garment/wearer_file.h"

namespace selvedge::experiments {

namespace {

constexpr size_t kPictures = 4;

double hem_width(const garment::Garment& garment, const garment::Worn& worn) {
  std::vector<Eigen::Index> hem;
  const double low = garment.standing.row(2).minCoeff(), high = garment.standing.row(2).maxCoeff();
  for (Eigen::Index v = 0; v < garment.standing.cols(); ++v)
    if (garment.standing(2, v) < low + 0.05 * (high - low)) hem.push_back(v);
  double sum = 0;
  for (const Eigen::Matrix3Xd& frame : worn.frames) {
    const Eigen::Matrix2Xd flat = frame(Eigen::seqN(0, 2), hem);
    sum += 2 * (flat.colwise() - flat.rowwise().mean()).colwise().norm().mean();
  }
  return worn.frames.empty() ? 0 : sum / static_cast<double>(worn.frames.size());
}

SkirtOutcome wear_one(const SkirtScene& scene, const SkirtPlan& plan, const Fabric& fabric,
                      const report::ProgressCallback& progress) {
  garment::Pattern pattern = scene.pattern;
  pattern.fabric = fabric.material;
  const garment::Garment garment = garment::sew(pattern);
  garment::WearOptions options;
  options.duration_s = plan.seconds;
  options.frames_per_s = plan.frames_per_s;
  options.progress = progress;
  const garment::Worn worn = garment::wear(pattern, garment, scene.wearer, options);
  SkirtOutcome out;
  out.fabric = fabric.name;
  out.triangles = garment.surface.triangles.size();
  out.frames = worn.frames.size();
  out.frames_that_intersect = worn.frames_that_intersect;
  out.largest_strain = worn.largest_strain;
  out.deepest_in_body_m = worn.deepest_in_body_m;
  out.simulated_s = worn.simulated_s;
  out.wall_s = worn.wall_s;
  out.finite = worn.finite;
  if (!worn.finite) return out;
  out.hem_width_m = hem_width(garment, worn);
  for (size_t i = 0; i < std::min(kPictures, worn.frames.size()); ++i) {
    const size_t f = (i + 1) * (worn.frames.size() - 1) / kPictures;
    out.pictures.push_back(garment::picture_of(garment, scene.wearer, worn.frames[f], worn.time_s[f]));
    out.picture_s.push_back(worn.time_s[f]);
  }
  return out;
}

std::filesystem::path picture_path(const std::filesystem::path& folder, const std::string& fabric, size_t k) {
  return folder / fmt::format("{}-{}.png", fabric, k + 1);
}

// The figures come last: with them everything is there.
void keep(const SkirtOutcome& s, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (size_t k = 0; k < s.pictures.size(); ++k) files::write_whole(picture_path(folder, s.fabric, k), s.pictures[k]);
  files::write_json(folder / (s.fabric + ".json"), {{"format", "kept-skirt/1"},
                                                    {"triangles", s.triangles},
                                                    {"frames", s.frames},
                                                    {"frames_that_intersect", s.frames_that_intersect},
                                                    {"largest_strain", s.finite ? s.largest_strain : 0},
                                                    {"deepest_in_body_m", s.finite ? s.deepest_in_body_m : 0},
                                                    {"hem_width_m", s.hem_width_m},
                                                    {"simulated_s", s.simulated_s},
                                                    {"wall_s", s.wall_s},
                                                    {"finite", s.finite},
                                                    {"picture_s", s.picture_s}});
}

SkirtOutcome kept_skirt(const std::string& fabric, const std::filesystem::path& folder) {
  const files::JsonReader in(folder / (fabric + ".json"));
  SkirtOutcome s;
  s.fabric = fabric;
  s.triangles = static_cast<size_t>(in.number("triangles"));
  s.frames = static_cast<size_t>(in.number("frames"));
  s.frames_that_intersect = static_cast<int>(in.number("frames_that_intersect"));
  s.largest_strain = in.number("largest_strain");
  s.deepest_in_body_m = in.number("deepest_in_body_m");
  s.hem_width_m = in.number("hem_width_m");
  s.simulated_s = in.number("simulated_s");
  s.wall_s = in.number("wall_s");
  s.finite = in.truth_or("finite", true);
  s.picture_s = in.numbers("picture_s", in.value("picture_s").size());
  for (size_t k = 0; k < s.picture_s.size(); ++k)
    s.pictures.push_back(files::read_whole(picture_path(folder, fabric, k)));
  return s;
}

}  // namespace

SkirtScene read_skirt_scene(const SkirtPlan& plan) {
  SkirtScene scene{garment::read_pattern(plan.pattern, plan.spacing_m),
                   garment::read_wearer(plan.pattern, plan.motion)};
  garment::body_of(scene.wearer, scene.pattern.where + ": limbs");  // names checked before the long work
  garment::sew(scene.pattern);                                      // as are seams
  return scene;
}

std::vector<SkirtOutcome> wear_skirts(const SkirtScene& scene, const SkirtPlan& plan,
                                      const std::vector<Fabric>& fabrics, const std::filesystem::path& folder,
                                      const report::ProgressCallback& progress) {
  std::vector<SkirtOutcome> all;
  const double count = static_cast<double>(fabrics.size());
  for (const Fabric& f : fabrics) {
    const double from = static_cast<double>(all.size()) / count;
    const auto part = [&](double done, const std::string& what) {
      progress(from + done / count, f.name + ": " + what);
    };
    if (std::filesystem::exists(folder / (f.name + ".json"))) {
      all.push_back(kept_skirt(f.name, folder));
    } else {
      all.push_back(wear_one(scene, plan, f, part));
      keep(all.back(), folder);
    }
  }
  return all;
}

}  // namespace selvedge::experiments
