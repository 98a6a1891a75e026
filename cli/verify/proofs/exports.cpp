// `./selvedge prove exports`: fabrics drawn from real values, exported for Blender and for Bullet, hung and waved there
// by the worked examples of examples/simulators, and how far they lie from ours. Fabrics come from ../shared; what is
// not there, or which package is not, is one figure that says so.
#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/exported_fabric.h"
#include "cli/verify/proofs/real_fabrics.h"
#include "cli/verify/proofs/worked_examples.h"
#include "cloth/spline/chosen_grid.h"
#include "station/simulator/foreign_simulator.h"

namespace selvedge::cli {

namespace {

constexpr int kQuads = 16;                                 // along a side, of both examples
constexpr double kShortest_m = 0.015, kLongest_m = 0.030;  // bending lengths that are looked at
// Of Bullet's example.
const station::MaterialMesh kExampleMesh{.spacing_m = kHungSide_m / kQuads, .step_s = 1.0 / 240, .iterations = 8};

struct ExportTarget {
  std::string name;
  station::MaterialFormat format;
  std::map<std::string, double> (*values)(const std::string& exported);
  WorkedExample example;
};

struct ExportedApart {
  std::vector<double> rest, motion, usual_rest, usual_motion;  // mm, one a fabric
  std::string unsaid;                                          // of the first
};

std::vector<DrawnFabric> drawn_between(const std::vector<DrawnFabric>& drawn, size_t count) {
  std::vector<DrawnFabric> out;
  for (const DrawnFabric& d : drawn) {
    const cloth::Material base = base_of(d.material);
    const double length_m = cloth::spline::bending_length_m(base);
    if (out.size() < count && length_m >= kShortest_m && length_m <= kLongest_m)
      out.push_back({fmt::format("{}, bending length {:.1f} mm", d.name, 1e3 * length_m), base});
  }
  return out;
}

ExportedApart apart_in(const ExportTarget& target, const std::vector<DrawnFabric>& fabrics,
                       const std::filesystem::path& log, const FigureOptions& options) {
  ExportedApart out;
  const station::ForeignSimulator simulator(target.example.command, {.log = log, .run_limit_s = 300, .processes = 1});
  std::map<std::string, double> usual;
  for (const station::SimulatorParameter& p : simulator.hello().parameters) usual[p.name] = p.usual;
  for (const DrawnFabric& fabric : fabrics) {
    options.progress(static_cast<double>(out.rest.size()) / static_cast<double>(fabrics.size()), target.name);
    const std::string exported =
        station::material_text(fitted_as(fabric.name, fabric.material), target.format, kExampleMesh);
    if (out.unsaid.empty()) out.unsaid = unsaid_in(exported);
    const cloth::Experiment motion = hung_and_waved(fabric.material, options.quick ? 0.25 : 1);
    const cloth::spline::SplineSheet sheet = hung_sheet(fabric.material);
    const HungApart said = apart_of(simulator, sheet, motion, target.values(exported)),
                    unsaid = apart_of(simulator, sheet, motion, usual);
    options.tell(fmt::format("{}, {}: at rest {:.1f} mm (default {:.1f}), in motion {:.1f} mm (default {:.1f})",
                             target.name, fabric.name, said.rest_mm, unsaid.rest_mm, said.motion_mm, unsaid.motion_mm));
    out.rest.push_back(said.rest_mm);
    out.motion.push_back(said.motion_mm);
    out.usual_rest.push_back(unsaid.rest_mm);
    out.usual_motion.push_back(unsaid.motion_mm);
  }
  return out;
}

// judged: of many fabrics, where the format can say all that they hang by.
void add_target(std::vector<Figure>& figures, const std::string& name, const ExportedApart& apart, bool judged) {
  const std::string over = fmt::format("{}, {} exported fabrics: ", name, apart.rest.size());
  const auto add = [&](const std::string& what, const std::vector<double>& said, const std::vector<double>& usual) {
    figures.push_back({over + "from ours " + what + ", median", median(said), median(usual), "mm rms",
                       judged ? Relation::at_most : Relation::shown, "its default parameters"});
    figures.push_back({over + "from ours " + what + ", worst", *std::max_element(said.begin(), said.end()),
                       *std::max_element(usual.begin(), usual.end()), "mm rms", Relation::shown,
                       "its default parameters"});
  };
  add("at rest", apart.rest, apart.usual_rest);
  add("in motion", apart.motion, apart.usual_motion);
  figures.push_back({over + "what the format cannot say", 0, 0, "", Relation::shown,
                     apart.unsaid.empty() ? "nothing" : apart.unsaid});
}

}  // namespace

std::vector<Figure> prove_exports(const FigureOptions& options) {
  const auto drawn = draw_real_fabrics(200, options.seed);
  if (!drawn)
    return {{"SKIPPED: ../shared/real/bending/fabrics.csv is not there, no fabric was exported", 0, 0, "",
             Relation::shown, "real fabrics"}};
  const std::vector<DrawnFabric> fabrics = drawn_between(*drawn, options.quick ? 1 : 8);
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("selvedge-prove-exports-{}", ::getpid());
  std::filesystem::create_directories(folder);
  std::vector<Figure> figures;
  for (const ExportTarget& target :
       {ExportTarget{"Blender's cloth", station::MaterialFormat::blender, blender_values,
                     blender_cloth_example(kQuads)},
        ExportTarget{"Bullet's soft body", station::MaterialFormat::bullet, bullet_values, bullet_example(folder)}}) {
    if (target.example.absent.empty()) {
      add_target(figures, target.name, apart_in(target, fabrics, folder / "simulator.log", options),
                 !options.quick && target.format == station::MaterialFormat::blender);
      continue;
    }
    figures.push_back({fmt::format("SKIPPED: Debian's package {} is not installed, {} was NOT tried",
                                   target.example.absent, target.name),
                       0, 0, "", Relation::shown, "sudo apt-get install " + target.example.absent});
  }
  std::filesystem::remove_all(folder);
  options.progress(1, "done");
  return figures;
}

}  // namespace selvedge::cli
