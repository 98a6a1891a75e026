// What open pages of the console cost: latency of the live picture, processor time, and frames of a recording beside
// them.
#pragma once

#include <cstdint>

#include "cli/verify/figures.h"

namespace selvedge::cli {

struct ConsoleRun {
  double bus_latency_s = 0;             // median, the camera's preview on the bus, no page open
  double page_latency_s = 0;            // median, mid-exposure to the event at a page, four pages open
  double idle_cores = 0;                // processor time of the console per second, no page open
  double open_cores = 0;                // with four pages
  int64_t frames = 0, frames_lost = 0;  // of a trial that was recorded with four pages open
  size_t previews = 0;
};

ConsoleRun run_console_with_pages(double seconds, const report::ProgressCallback& progress);

}  // namespace selvedge::cli
