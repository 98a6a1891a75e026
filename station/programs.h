// The programs that one build makes, found from the one that runs: beside it in a build folder; in bin/ and
// lib/selvedge/ of one prefix where they are installed.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace selvedge::station {

inline constexpr const char* kLabProgram = "selvedge";             // the devices' daemons and all that a lab runs
inline constexpr const char* kSimulationProgram = "selvedge-sim";  // simulated devices and worlds
inline constexpr const char* kVerifyProgram = "selvedge-verify";   // proofs, timings, soak runs, blind checks

// nullopt where it is not installed.
std::optional<std::filesystem::path> find_program(const std::string& name);

// Throws BadInput that names the program and where it was looked for.
std::filesystem::path program(const std::string& name);

}  // namespace selvedge::station
