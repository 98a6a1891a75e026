// ./selvedge garment FILE --out DIR: sews a garment and lets a recorded motion wear it.
#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>

#include "cli/command.h"
#include "cli/output_folder.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "garment/pictures.h"
#include "garment/synthetic_walk.h"
#include "garment/wearer_file.h"
#include "report/progress.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;

struct GarmentArguments {
  fs::path pattern, out, motion, walk_to;
  double spacing_m = 0, seconds = 1e9, frames_per_s = 30;
};

void run_garment(const GarmentArguments& a) {
  if (!a.walk_to.empty()) {
    files::write_whole(a.walk_to, garment::synthetic_walk(std::min(a.seconds, 10.0)));
    fmt::print("wrote {}\n", a.walk_to.string());
    return;
  }
  if (a.pattern.empty() || a.out.empty())
    refuse("garment", "found no {}, expected a garment's file and --out DIR", a.pattern.empty() ? "FILE" : "--out");
  expect_folder("--out", a.out);
  const garment::Pattern pattern = garment::read_pattern(a.pattern, a.spacing_m);
  const garment::Wearer wearer = garment::read_wearer(a.pattern, a.motion);
  garment::body_of(wearer, pattern.where + ": limbs");  // names checked before the long work
  const garment::Garment garment = garment::sew(pattern);
  fmt::print("{} triangles, {} vertices held\n", garment.surface.triangles.size(), garment.held.size());
  const garment::Worn worn =
      garment::wear(pattern, garment, wearer,
                    {a.seconds, a.frames_per_s, report::terminal_progress("garment " + a.pattern.stem().string())});
  if (!worn.finite)
    throw std::runtime_error(
        "garment: the motion of the fabric diverged; a smaller spacing or a softer fabric may help");
  fs::create_directories(a.out);
  garment::write_obj_sequence(garment, wearer, worn, a.out);
  garment::write_report(pattern, garment, wearer, worn, a.out / "report.html");
  fmt::print(
      "{:.1f} s of motion, {:.1f} s of wall time per simulated second; {} of {} frames with intersecting triangles\n",
      worn.time_s.back(), worn.wall_s / worn.simulated_s, worn.frames_that_intersect, worn.frames.size());
  fmt::print("wrote {} and {} frames\n", (a.out / "report.html").string(), worn.frames.size());
}

}  // namespace

void add_garment(CLI::App& app, int&) {
  auto* command = app.add_subcommand("garment", "sews a garment from its panels and lets a recorded motion wear it");
  auto a = std::make_shared<GarmentArguments>();
  command->add_option("FILE", a->pattern, "the garment: panels, seams, fabric, body (docs/garment.md)");
  command->add_option("--out", a->out, "folder for the OBJ sequence and report.html");
  command->add_option("--motion", a->motion, "another BVH file than the one the garment names");
  command->add_option("--spacing", a->spacing_m, "between vertices, m, instead of the file's")
      ->check(CLI::Range(0.002, 0.2));
  command->add_option("--seconds", a->seconds, "of the motion; all of it by default")->check(CLI::Range(0.1, 1e9));
  command->add_option("--frames-per-second", a->frames_per_s, "that are kept")
      ->check(CLI::Range(1.0, 1000.0))
      ->capture_default_str();
  command->add_option("--write-walk", a->walk_to, "only writes a synthetic walk to this BVH file");
  command->callback([a] { run_garment(*a); });
}

}  // namespace selvedge::cli
