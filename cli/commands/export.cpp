// ./selvedge export TRIAL --hdf5 FILE | --lcm FILE | --mcap FILE | --obj DIR: trials to formats of others; FIT --as
// SIMULATOR --out FILE: a fitted fabric as parameters of other simulators.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "capture/trial/trial.h"
#include "cli/command.h"
#include "cli/output_folder.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "station/exchange/hdf5_export.h"
#include "station/exchange/lcm_export.h"
#include "station/exchange/material_export.h"
#include "station/exchange/mcap_export.h"
#include "station/exchange/obj_sequence.h"

namespace selvedge::cli {

namespace {

struct ExportArguments {
  std::filesystem::path trial, hdf5, lcm, mcap, obj, fit, out;
  std::string as;
  station::MaterialMesh mesh;
};

void export_material(const ExportArguments& a) {
  if (a.out.empty()) refuse("--out", "found none, expected the file that --as {} is written to", a.as);
  if (!a.hdf5.empty() || !a.lcm.empty() || !a.mcap.empty() || !a.obj.empty())
    refuse("--as",
           "found it with --hdf5, --lcm, --mcap or --obj, expected it alone: it takes a fit, they take a trial");
  const std::vector<std::string>& names = station::material_format_names();
  const auto format = static_cast<station::MaterialFormat>(std::find(names.begin(), names.end(), a.as) - names.begin());
  const std::filesystem::path fit = std::filesystem::is_directory(a.trial) ? a.trial / "fit.json" : a.trial;
  files::write_whole(a.out, station::material_text(station::fitted_fabric(fit), format, a.mesh));
  fmt::print("wrote {}; what of the conversion is not exact, and what could not be said, is in it\n", a.out.string());
}

// --fit, or the folder that the trial lies in.
std::filesystem::path fit_of(const ExportArguments& a) {
  return a.fit.empty() ? std::filesystem::weakly_canonical(a.trial).parent_path() : a.fit;
}

void run_mcap(const ExportArguments& a, const trial::Trial& trial) {
  std::optional<station::SimulatedMotion> simulated;
  if (!a.fit.empty() || std::filesystem::exists(station::motion_path(fit_of(a), trial.name)))
    simulated = station::read_simulated_motion(fit_of(a), trial.name);
  const station::McapExported written = station::export_mcap(trial, simulated, a.mcap);
  fmt::print("wrote {}: {} messages, {:.1f} s, {}\n", a.mcap.string(), written.messages, written.duration_s,
             simulated ? "with the fitted motion" : "without a fitted motion (--fit FOLDER adds one)");
}

void run_export(const ExportArguments& a) {
  if (!a.as.empty()) return export_material(a);
  if (a.hdf5.empty() && a.lcm.empty() && a.mcap.empty() && a.obj.empty())
    refuse("export", "expected --hdf5 FILE, --lcm FILE, --mcap FILE, --obj DIR, or several of them; or --as SIMULATOR");
  expect_folder("--obj", a.obj);
  if (!a.lcm.empty()) {
    const station::LcmExported log = station::export_lcm(a.trial, a.lcm);
    fmt::print("wrote {}: {} trials, {} messages, {:.1f} s\n", a.lcm.string(), log.trials, log.events, log.duration_s);
  }
  if (a.hdf5.empty() && a.mcap.empty() && a.obj.empty()) return;
  const trial::Trial trial = trial::read_trial(a.trial);
  if (trial::is_material_test(trial.experiment))
    refuse((a.trial / "trial.json").string(), "found a material test, expected a trial with motion to export");
  if (!a.hdf5.empty()) {
    station::export_hdf5(trial, a.hdf5);
    fmt::print("wrote {}\n", a.hdf5.string());
  }
  if (!a.mcap.empty()) run_mcap(a, trial);
  if (a.obj.empty()) return;
  fmt::print("wrote {} files to {}\n",
             station::write_obj_sequence(station::read_simulated_motion(fit_of(a), trial.name), a.obj), a.obj.string());
}

}  // namespace

void add_export(CLI::App& app, int&) {
  auto* out =
      app.add_subcommand("export",
                         "a trial as HDF5, as MCAP beside its fitted motion, or as the bus's messages (LCM log), its "
                         "fitted motion as OBJ files; a "
                         "fitted fabric as parameters of other simulators");
  auto a = std::make_shared<ExportArguments>();
  out->add_option("TRIAL", a->trial, "folder of a trial; for --lcm also a campaign or a run; for --as a fit")
      ->required();
  out->add_option("--hdf5", a->hdf5, "file to write: all that was recorded, units as attributes");
  out->add_option("--lcm", a->lcm,
                  "LCM event log to write: the bus's messages at their recorded times, for lcm-logplayer");
  out->add_option("--mcap", a->mcap,
                  "file to write: recorded beside fitted motion over time, for Foxglove and other viewers");
  out->add_option("--obj", a->obj, "folder to write: the fitted motion, one file a frame");
  out->add_option("--fit", a->fit, "folder of the fit, for --obj and --mcap; default: the one that the trial lies in");
  out->add_option("--as", a->as, "the simulator whose parameters the fitted fabric is written as")
      ->check(CLI::IsMember(station::material_format_names()));
  out->add_option("--out", a->out, "file to write, for --as");
  out->add_option("--spacing", a->mesh.spacing_m, "of that simulator's grid (mujoco, blender, bullet)")
      ->check(CLI::PositiveNumber)
      ->type_name("METRES")
      ->capture_default_str();
  out->add_option("--step", a->mesh.step_s, "of that simulator (bullet)")
      ->check(CLI::PositiveNumber)
      ->type_name("SECONDS")
      ->capture_default_str();
  out->add_option("--iterations", a->mesh.iterations, "of positions in a step of that simulator (bullet)")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  out->callback([a] { run_export(*a); });
}

}  // namespace selvedge::cli
