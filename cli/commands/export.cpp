// ./selvedge export TRIAL --hdf5 FILE | --lcm FILE | --obj DIR: trials to formats of others.
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "capture/trial/trial.h"
#include "cli/command.h"
#include "cli/output_folder.h"
#include "files/bad_input.h"
#include "station/exchange/hdf5_export.h"
#include "station/exchange/lcm_export.h"
#include "station/exchange/obj_sequence.h"

namespace selvedge::cli {

namespace {

struct ExportArguments {
  std::filesystem::path trial, hdf5, lcm, obj, fit;
};

void run_export(const ExportArguments& a) {
  if (a.hdf5.empty() && a.lcm.empty() && a.obj.empty())
    refuse("export", "expected --hdf5 FILE, --lcm FILE, --obj DIR, or several of them");
  expect_folder("--obj", a.obj);
  if (!a.lcm.empty()) {
    const station::LcmExported log = station::export_lcm(a.trial, a.lcm);
    fmt::print("wrote {}: {} trials, {} messages, {:.1f} s\n", a.lcm.string(), log.trials, log.events, log.duration_s);
  }
  if (a.hdf5.empty() && a.obj.empty()) return;
  const trial::Trial trial = trial::read_trial(a.trial);
  if (trial::is_material_test(trial.experiment))
    refuse((a.trial / "trial.json").string(), "found a material test, expected a trial with motion to export");
  if (!a.hdf5.empty()) {
    station::export_hdf5(trial, a.hdf5);
    fmt::print("wrote {}\n", a.hdf5.string());
  }
  if (a.obj.empty()) return;
  const std::filesystem::path fit = a.fit.empty() ? std::filesystem::weakly_canonical(a.trial).parent_path() : a.fit;
  fmt::print("wrote {} files to {}\n",
             station::write_obj_sequence(station::read_simulated_motion(fit, trial.name), a.obj), a.obj.string());
}

}  // namespace

void add_export(CLI::App& app, int&) {
  auto* out = app.add_subcommand("export",
                                 "a trial as HDF5 or as the bus's messages (LCM log), its fitted motion as OBJ files");
  auto a = std::make_shared<ExportArguments>();
  out->add_option("TRIAL", a->trial, "folder of a trial; for --lcm also a campaign or a run")->required();
  out->add_option("--hdf5", a->hdf5, "file to write: all that was recorded, units as attributes");
  out->add_option("--lcm", a->lcm,
                  "LCM event log to write: the bus's messages at their recorded times, for lcm-logplayer");
  out->add_option("--obj", a->obj, "folder to write: the fitted motion, one file a frame");
  out->add_option("--fit", a->fit, "folder of the fit, for --obj; default: the one that the trial lies in");
  out->callback([a] { run_export(*a); });
}

}  // namespace selvedge::cli
