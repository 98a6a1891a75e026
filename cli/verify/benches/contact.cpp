// `./selvedge bench contact`: what contact costs a waved swatch, in one run on one core.
#include <algorithm>
#include <string>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/contact_cases.h"
#include "cli/verify/proofs/skirt_case.h"

namespace selvedge::cli {

namespace {

double median_wall_s(const ContactScene& scene, bool with_contact, int repeats) {
  std::vector<double> walls;
  for (int i = 0; i < repeats; ++i) walls.push_back(run_contact_scene(scene, with_contact).wall_s);
  return median(std::move(walls));
}

}  // namespace

std::vector<Figure> bench_contact(const FigureOptions& options) {
  const double duration_s = options.quick ? 0.5 : 2;
  const int repeats = options.quick ? 1 : 3;
  std::vector<Figure> figures;
  for (const int columns : {17, 33, 65}) {
    if (columns == 65 && options.quick) continue;
    options.progress((columns - 17) / 65.0, std::to_string(columns) + " x " + std::to_string(columns) + " vertices");
    ContactScene scene = waved_swatch(columns, duration_s);
    const double off = median_wall_s(scene, false, repeats) / duration_s,
                 on = median_wall_s(scene, true, repeats) / duration_s;
    scene.options.culling = false;
    const double unculled = median_wall_s(scene, true, repeats) / duration_s;
    const std::string what =
        "waved knit, " + std::to_string(columns) + "x" + std::to_string(columns) + ": wall time per simulated second, ";
    figures.push_back(
        {what + "contact off", off, columns == 33 ? 0.3 : 0, "s", Relation::shown, columns == 33 ? "aim" : ""});
    figures.push_back({what + "contact on", on, off, "s", Relation::shown, "contact off, the same run"});
    figures.push_back(
        {what + "contact on, no curvature criterion", unculled, on, "s", Relation::shown, "with it, the same run"});
  }
  const WornSkirt skirt = wear_walking_skirt(
      options.quick ? 1200 : 20000, options.quick ? 0.4 : 1.5,
      [&](double done, const std::string& what) { options.progress(0.8 + 0.2 * done, "skirt: " + what); });
  figures.push_back(
      {"skirt of " + std::to_string(skirt.triangles) + " triangles on a walking body: wall time per simulated second",
       skirt.worn.wall_s / skirt.worn.simulated_s, 30, "s", Relation::shown, "aim at 20000 triangles"});
  return figures;
}

}  // namespace selvedge::cli
