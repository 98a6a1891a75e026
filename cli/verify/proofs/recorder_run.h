// One recorder for `./selvedge prove recorder`: what it records, the process that does, and what of it must read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace selvedge::cli {

// What the recorder's process says of itself, on its standard output, again and again.
struct RecorderReport {
  enum State : uint64_t { recording, complete, cut };
  uint64_t state = recording;
  uint64_t corners = 0, markers = 0, robot = 0, frames = 0;  // called durable
  uint64_t written_corners = 0, written_frames = 0;
  uint64_t journal = 0;  // lines of a journal beside the trial, each synced by itself
};

struct RecorderJob {
  std::filesystem::path trial;  // its folder
  int rows = 0;                 // of each kind, then it finishes
  bool too_early = false;       // calls durable what is only written: what the proof must catch
};

// In the process of its own.
void record_job(const RecorderJob& job);

// Recovers and reads what is left of the trial. Empty, or how it falls short of the newest report. began: whether there
// was one.
std::string shortfall(const std::filesystem::path& trial, const RecorderReport& report, bool began);

}  // namespace selvedge::cli
