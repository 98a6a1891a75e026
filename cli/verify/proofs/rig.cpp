// `./selvedge prove rig`: what was set in the simulators' clocks comes back from the daemons, over the real wire and
// in real time, and the stated uncertainty covers what is missing.
#include <future>

#include <spdlog/spdlog.h>

#include "cli/verify/figures.h"
#include "cli/verify/proofs/clock_run.h"
#include "cli/verify/proofs/stood_still.h"
#include "rig/network.h"
#include "station/free_addresses.h"

namespace selvedge::cli {

namespace {

constexpr int kAtATime = 5;      // runs beside each other: more would wait for the processor, not for the wire
constexpr double kTrial_s = 10;  // over which a wrong drift grows

std::vector<ClockRun> run_all(const FigureOptions& options, int runs) {
  std::vector<ClockRun> results;
  while (static_cast<int>(results.size()) < runs) {
    options.progress(static_cast<double>(results.size()) / runs, fmt::format("run {} of {}", results.size() + 1, runs));
    std::vector<std::future<ClockRun>> group;
    for (int i = 0; i < kAtATime && static_cast<int>(results.size() + group.size()) < runs; ++i) {
      const auto run = static_cast<unsigned>(results.size() + group.size());
      ClockRunOptions o;
      o.seed = options.seed + 100 * run;
      if (run % 2 == 1) o.clock_offset_s = -o.clock_offset_s;
      if (run % 4 >= 2) o.clock_drift_ppm = -o.clock_drift_ppm;
      if (options.quick) o.settle_s = o.watch_s = 5;
      group.push_back(std::async(std::launch::async, [o] { return run_clocks(o); }));
    }
    for (auto& run : group) results.push_back(run.get());
  }
  return results;
}

void add(std::vector<Figure>& figures, const std::vector<ClockRun>& runs, Found ClockRun::*what,
         const std::string& name) {
  double largest_s = 0;
  int covered = 0;
  std::vector<double> stated_ms;
  for (const ClockRun& run : runs) {
    largest_s = std::max(largest_s, std::abs((run.*what).error_s));
    covered += (run.*what).covered();
    stated_ms.push_back(1e3 * (run.*what).sd_s);
  }
  const auto count = static_cast<double>(runs.size());
  figures.push_back(
      {name + ": largest error", 1e3 * largest_s, 0.1, "ms", Relation::at_most, "as set in the simulator"});
  figures.push_back({name + ": runs that two stated deviations cover", static_cast<double>(covered),
                     std::floor(0.95 * count), fmt::format("of {}", count), Relation::at_least, "19 of 20"});
  figures.push_back({name + ": stated deviation, median", median(stated_ms), 0.1, "ms", Relation::shown,
                     "the largest error allowed"});
}

}  // namespace

std::vector<Figure> prove_rig(const FigureOptions& options) {
  rig::ensure_local_multicast(static_cast<uint16_t>(station::free_bus_port()));
  spdlog::set_level(spdlog::level::err);
  const StoodStill machine;
  const std::vector<ClockRun> runs = run_all(options, options.quick ? 4 : 20);
  std::vector<Figure> figures;
  figures.push_back({"longest that this machine stood still", 1e3 * machine.longest_s(), 0, "ms", Relation::shown,
                     "clocks are judged where it hardly does"});
  add(figures, runs, &ClockRun::camera, "GigE camera's clock, ±5 s and ±50 ppm off");
  double drift_ppm = 0;
  for (const ClockRun& run : runs) drift_ppm = std::max(drift_ppm, std::abs(run.camera_drift_error_ppm));
  figures.push_back({fmt::format("its drift's largest error, over {} s", kTrial_s), 1e-3 * drift_ppm * kTrial_s, 0.1,
                     "ms", Relation::at_most, "50 ppm set"});
  add(figures, runs, &ClockRun::optitrack, "NatNet samples, clock ±5 s and ±50 ppm off");
  add(figures, runs, &ClockRun::vicon, "DataStream samples, no clock");
  add(figures, runs, &ClockRun::delay, "delay of 13.7 ms from moving discs");
  std::vector<double> by_arrivals_ms;
  for (const ClockRun& run : runs) by_arrivals_ms.push_back(1e3 * std::abs(run.camera_by_arrivals.error_s));
  figures.push_back({"GigE camera's clock from arrivals alone, median error", median(by_arrivals_ms), 0.1, "ms",
                     Relation::shown, "the transfer's time is not known then"});
  return figures;
}

}  // namespace selvedge::cli
