// What is wrong with a simulator that speaks `simulator/1`, found by asking it small cases: a square that hangs, one
// that is waved, the same again, other parameters, a second process beside the first.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace selvedge::station {

struct SimulatorFinding {
  enum class Kind { good, remark, wrong };
  Kind kind = Kind::good;
  std::string text;
};

struct SimulatorCheckOptions {
  std::filesystem::path log;  // its standard error goes there
  double run_limit_s = 60;
  std::function<void(const SimulatorFinding&)> tell = [](const SimulatorFinding&) {};  // each at once
};

// In the order of asking. After a breach of the protocol nothing more is asked. Throws nothing that the simulator can
// cause.
std::vector<SimulatorFinding> check_simulator(const std::string& command, const SimulatorCheckOptions& options);

}  // namespace selvedge::station
