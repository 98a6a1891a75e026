// ./selvedge import SOURCE --out DIR: recordings of others as trials, by a mapping file; and what instruments and
// cameras give of a material test, with --as.
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "capture/trial/doubts.h"
#include "cli/command.h"
#include "cli/commands/fit_of_tests.h"
#include "cli/output_folder.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "station/exchange/import_mapping.h"
#include "station/exchange/material_import.h"
#include "station/exchange/outline_import.h"
#include "station/exchange/trial_preview.h"

namespace selvedge::cli {

namespace {

struct ImportArguments {
  station::MaterialImport from;
  std::filesystem::path out;
  std::string as, scale;
  double areal_mass = 0, angle_deg = 0, overhang_mm = 0, bending_length_mm = 0, clamp_mm = 0;
  std::vector<double> edge_px, strip_mm;
  double gauge_mm = 100, disc_mm = 300, support_mm = 180;
  std::vector<double> centre_px;
  std::vector<int> along, across;
  std::vector<std::string> columns;
  bool fit = false;
};

// What was given on the command line, in the import's units.
station::MaterialImport material_import(const ImportArguments& a, const CLI::App& command) {
  station::MaterialImport from = a.from;
  const auto given = [&](const char* option) { return command.count(option) > 0; };
  if (given("--areal-mass")) from.areal_mass = a.areal_mass;
  if (given("--angle-deg")) from.angle_deg = a.angle_deg;
  if (given("--overhang-mm")) from.overhang_m = 1e-3 * a.overhang_mm;
  if (given("--bending-length-mm")) from.bending_length_m = 1e-3 * a.bending_length_mm;
  if (given("--clamp-mm")) from.hdf5.clamp_m = 1e-3 * a.clamp_mm;
  if (given("--edge-px")) from.edge_px = Eigen::Vector2d(a.edge_px[0], a.edge_px[1]);
  if (given("--scale")) from.mm_per_px = station::mm_per_px_of(a.scale);
  if (given("--strip-mm")) {
    from.width_m = 1e-3 * a.strip_mm[0];
    from.height_m = 1e-3 * a.strip_mm[1];
  }
  from.gauge_m = 1e-3 * a.gauge_mm;
  if (given("--along")) from.hdf5.along = {a.along[0], a.along[1]};
  if (given("--across")) from.hdf5.across = {a.across[0], a.across[1]};
  for (const std::string& pair : a.columns) {
    const size_t equals = pair.find('=');
    if (equals == std::string::npos || equals == 0)
      refuse("--columns", "found {}, expected OURS=THEIRS", in_quotes(pair));
    from.columns[pair.substr(0, equals)] = pair.substr(equals + 1);
  }
  if (from.fabric.empty()) refuse("--fabric", "found nothing, expected the fabric's name");
  return from;
}

void import_discs(const ImportArguments& a, const station::MaterialImport& common) {
  station::OutlineImport from{common.file,         common.fabric,    common.areal_mass, 1e-3 * a.disc_mm,
                              1e-3 * a.support_mm, common.mm_per_px, common.columns,    {}};
  if (!a.centre_px.empty()) from.centre_px = Eigen::Vector2d(a.centre_px[0], a.centre_px[1]);
  const station::ImportedOutlines found = station::import_cusick(from);
  const auto folders = station::add_to_campaign(found.trials, a.out);
  for (size_t i = 0; i < folders.size(); ++i) {
    fmt::print("wrote {}: {} captures\n", folders[i].string(), found.trials[i].cusick->outlines.size());
    if (i < found.pictures.size()) files::write_whole(folders[i] / "found.png", found.pictures[i].second);
  }
  fmt::print("{}\n", found.scale);
  if (a.fit) fit_tests_and_write(trial::read_campaign(a.out), {}, a.out / "fit");
}

void import_test(const ImportArguments& a, const CLI::App& command) {
  const station::MaterialImport from = material_import(a, command);
  if (a.as == "cusick") return import_discs(a, from);
  const station::ImportedStrips tests = a.as == "tensile" ? station::ImportedStrips{{station::import_tensile(from)}, ""}
                                                          : station::import_cantilever(from);
  for (const auto& folder : station::add_to_campaign(tests.trials, a.out)) {
    fmt::print("wrote {}\n", folder.string());
    if (!tests.picture.empty()) {
      files::write_whole(folder / "found.png", tests.picture);
      fmt::print("wrote {}: the strip that was found, its edge and its tip\n", (folder / "found.png").string());
    }
    if (a.fit) fit_tests_and_write(trial::read_campaign(folder), {}, folder / "fit");
  }
}

void add_options_of_tests(CLI::App& in, ImportArguments& a) {
  const std::string strips = "cantilever: ", discs = "cusick: ", pulls = "tensile: ";
  in.add_option("--as", a.as, "the material test that SOURCE is of; without it SOURCE is a mapping file")
      ->check(CLI::IsMember({"cantilever", "cusick", "tensile"}));
  in.add_flag("--fit", a.fit, "fits what was imported too: fit.json and report.html in the trial's folder, below fit");
  in.add_option("--name", a.from.name, "of the trial; by default the file's");
  in.add_option("--fabric", a.from.fabric, "the fabric's name");
  in.add_option("--areal-mass", a.areal_mass, "of the fabric, kg/m²")->check(CLI::PositiveNumber);
  in.add_option("--angle-deg", a.angle_deg, "of the strip's length from the warp");
  in.add_option("--strip-mm", a.strip_mm, "the strip's width and length")->delimiter(',')->expected(2);
  in.add_option("--columns", a.columns, "OURS=THEIRS, …: what columns of a CSV are called there")->delimiter(',');
  in.add_option("--overhang-mm", a.overhang_mm, strips + "length beyond the edge; by default that of the midline");
  in.add_option("--bending-length-mm", a.bending_length_mm, strips + "as an instrument gave it beside the midline");
  in.add_option("--mm-per-px", a.from.mm_per_px,
                strips + "the scale of a photograph; of discs too, by default from the support's rim");
  in.add_option("--scale", a.scale, strips + "the same by two points of it: X1,Y1,X2,Y2=MM");
  in.add_option("--edge-px", a.edge_px, strips + "X,Y of the table's edge in it, where that is not seen")
      ->delimiter(',')
      ->expected(2);
  in.add_option("--disc-mm", a.disc_mm, discs + "the disc's diameter")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  in.add_option("--support-mm", a.support_mm, discs + "the support's diameter")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  in.add_option("--centre-px", a.centre_px, discs + "X,Y of the support's centre; by default the pictures' middle")
      ->delimiter(',')
      ->expected(2);
  in.add_option("--force-unit", a.from.force_unit, pulls + "unit of the force as it was recorded")
      ->capture_default_str();
  in.add_option("--gauge-mm", a.gauge_mm, pulls + "length at rest whose stretch is measured")->capture_default_str();
  in.add_option("--clamp-mm", a.clamp_mm, pulls + "width of the clamp (HDF5, where lengths are in px)")
      ->check(CLI::PositiveNumber);
  in.add_option("--frame-rate", a.from.hdf5.frame_rate_hz, pulls + "of the camera, Hz (HDF5)")->capture_default_str();
  in.add_option("--along", a.along, pulls + "the two points whose distance is along (HDF5); 2,3 by default")
      ->delimiter(',')
      ->expected(2);
  in.add_option("--across", a.across, pulls + "the same across; 0,1 by default")->delimiter(',')->expected(2);
}

}  // namespace

void add_import(CLI::App& app, int&) {
  auto* in = app.add_subcommand(
      "import", "recordings and material tests of others as trials: images, marker CSV, photographs, HDF5");
  auto a = std::make_shared<ImportArguments>();
  in->add_option("SOURCE", a->from.file, "a mapping file (TOML), or with --as a file of a test: docs/exchange.md")
      ->required();
  in->add_option("--out", a->out, "folder in which the trial's folder is made")->required();
  add_options_of_tests(*in, *a);
  in->callback([a, in] {
    expect_folder("--out", a->out);
    if (!a->as.empty()) return import_test(*a, *in);
    const std::filesystem::path folder = station::import_recording(a->from.file, a->out);
    const trial::Trial trial = trial::read_trial(folder);
    station::write_preview(trial, folder / "preview.html");
    fmt::print("wrote {}; look at it in {}\n", folder.string(), (folder / "preview.html").string());
    for (const std::string& doubt : trial::doubts(trial)) fmt::print("doubt: {}\n", doubt);
  });
}

}  // namespace selvedge::cli
