// A simulated rig under faults: every daemon and the recorder a process of its own, the devices in this one, trials one
// after another, until the time is over.
//
// Faults come at random times (faults.h). What is killed is started again a second later, as systemd would. Nothing
// that was written may be lost (frame_audit.h), and the arm may not move after a stop (arm_audit.h), which people give
// (people.h). A daemon that ends by itself counts as well. At the end the faults stop, and the rig is given a while to
// record one whole trial. A run of an hour or more must have seen each kind of fault kLeastEach times.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/verify/soak/faults.h"
#include "report/progress.h"

namespace selvedge::cli {

inline constexpr int kLeastEach = 5;

struct SoakOptions {
  double hours = 1;
  unsigned seed = 1;
  std::filesystem::path rig, world, arms;
  std::filesystem::path folder;  // for logs and configurations; trials too where no disk can be mounted
  report::ProgressCallback progress = [](double, const std::string&) {};
};

struct SoakResult {
  double hours = 0;
  FaultCounts faults{};
  bool small_disk = false;  // false: nothing could be mounted, so no disk ran full
  int trials_complete = 0, trials_cut = 0;
  int64_t frames_written = 0, frames_lost = 0;
  int stops = 0, operator_stops = 0, stops_in_motion = 0, resets = 0;
  int motions_after_stop = 0;  // measured at the simulated joints
  double longest_time_to_rest_s = 0, longest_after_operator_s = 0;
  std::vector<std::string> violations;       // of people who ought not to have got through
  bool recovered = false;                    // a whole trial after the last fault
  std::vector<std::string> losses, crashes;  // one sentence each
  bool each_often_enough() const;
  bool holds() const {
    return frames_lost == 0 && motions_after_stop == 0 && violations.empty() && crashes.empty() && each_often_enough();
  }
};

// Throws BadInput for files that are no good. Call before the process has threads.
SoakResult soak(const SoakOptions& options, const std::atomic<bool>& stopping);

nlohmann::json to_json(const SoakResult& result, unsigned seed);
std::string to_text(const SoakResult& result);

}  // namespace selvedge::cli
