// A session of several fabrics as one readable file: what is hung, recorded, fitted and diagnosed, and what to do when
// a step fails. Paths are relative to the file. Unknown keys are refused by name.
//
//   [session]
//   rig = "demo-rig.toml"              # devices, calibration grid, stripes; its [fabric] and trials are not used
//   world = "demo-world.toml"          # a simulated rig: its devices are started; leave out on a rig that is up
//   fabrics = ["linen", "knit"]        # in this order
//   trials = ["static-1", "waving-1"]  # of each fabric
//   [session.waving-1]                 # as in a rig's configuration (capture/session/session_plan.h), and
//   repeats = 2                        # recorded as waving-1-1 and waving-1-2, which count as the same motion
//   [fabric.linen]
//   width_m = 0.3                      # height_m, mass_kg, mass_known likewise
//   world = {bend = 4e-4}              # simulated rig: as [fabric] of its world, and effect, strength
//   [calibration]
//   when = "once"                      # "each" fabric, or "reuse" of file = "…/calibration.json"
//   [checks]
//   most_frames_lost = 0.02            # share; a trial beyond it is recorded again
//   most_occluded = 0.3                # share of the samples in which a held corner is hidden
//   at_rest = true                     # a trial must begin at rest
//   drift = true                       # camera and projector must still stand where they were calibrated
//   [fit]
//   run = true
//   cells = 13                         # of the grid along the width; 0: as the fabric asks
//   [diagnosis]
//   run = true
//   effects = ["hem"]                  # all where left out; cells: as of the fit
//   follow_up = 0                      # experiments that the diagnosis proposes and that are appended and recorded
//   confirm = false                    # a second session after the first diagnosis, which its effect has to predict
//   [on_failure]
//   record = "repeat 2, skip"          # calibrate, record, fit, diagnose: "repeat N", then "stop", "skip" or "ask"
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/session/session_plan.h"

namespace selvedge::station {

struct OnFailure {
  enum class Then { stop, skip, ask };
  int repeats = 0;  // further attempts
  Then then = Then::stop;
};

struct SwatchPlan {
  std::string name;
  session::SessionPlan plan;                         // its fabric and its trials
  std::vector<std::vector<std::string>> replicates;  // names of trials that are the same motion
};

struct SessionChecks {
  double most_frames_lost = 0.02;
  double most_occluded = 0.3;
  bool at_rest = true;
  bool drift = true;
};

enum class CalibrationPolicy { once, each, reuse };

struct SessionFile {
  std::filesystem::path path;
  std::string text;  // whole, as read
  std::filesystem::path rig;
  std::optional<std::filesystem::path> world;  // simulated
  std::string simulated_world;                 // TOML: that world with the swatches of all fabrics; empty without world
  std::vector<SwatchPlan> fabrics;
  CalibrationPolicy calibration = CalibrationPolicy::once;
  std::filesystem::path calibration_file;  // with reuse
  SessionChecks checks;
  bool fit = true, diagnosis = true;
  int fit_cells = 0;
  std::vector<std::string> effects;
  int diagnosis_cells = 0;
  int follow_up = 0;
  bool confirm = false;
  std::map<std::string, OnFailure> on_failure;  // "calibrate", "record", "fit", "diagnose", "confirm"
  bool in_place = false;  // of one fabric, whose trials lie in the session's folder itself, not in one of its name

  std::filesystem::path folder_of(size_t fabric, const std::filesystem::path& session) const;
};

// Throws BadInput naming file, section and key.
SessionFile read_session_file(const std::filesystem::path& path);

// What a simulated rig's own configuration describes: its fabric and trials, calibrated and recorded in place as they
// come, unchecked; the first failure stops it. Fits and diagnoses are left to whoever asks for it.
SessionFile session_of_rig(const std::filesystem::path& rig, const std::filesystem::path& world);

// The plan of a fabric's trials that a diagnosis proposes (its next_session.toml), the rest as before; none where the
// proposal asks for something by hand that no prompt of a trial says, or for nothing.
std::optional<session::SessionPlan> read_follow_up(const SessionFile& file, size_t fabric,
                                                   const std::filesystem::path& proposal);

}  // namespace selvedge::station
