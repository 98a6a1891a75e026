// How the command line is put together: one function a command, in commands/NAME.cpp (sim/NAME.cpp,
// verify/commands/NAME.cpp for the other programs), that adds its subcommand and what to run. A new command is its
// file, its line here, and its name in the list.cpp beside it. Every function throws BadInput for what a user can mend
// (exit 2).
#pragma once

#include <vector>

#include <CLI/CLI.hpp>

namespace selvedge::cli {

// exit_status: what main returns when the command ran without an exception.
using AddCommand = void (*)(CLI::App& app, int& exit_status);

void add_bench(CLI::App& app, int& exit_status);
void add_blind(CLI::App& app, int& exit_status);
void add_calibrate(CLI::App& app, int& exit_status);
void add_check(CLI::App& app, int& exit_status);
void add_compare(CLI::App& app, int& exit_status);
void add_console(CLI::App& app, int& exit_status);
void add_daemon(CLI::App& app, int& exit_status);
void add_demo(CLI::App& app, int& exit_status);
void add_diagnose(CLI::App& app, int& exit_status);
void add_export(CLI::App& app, int& exit_status);
void add_fabrics(CLI::App& app, int& exit_status);
void add_experiment(CLI::App& app, int& exit_status);
void add_fit(CLI::App& app, int& exit_status);
void add_garment(CLI::App& app, int& exit_status);
void add_prove(CLI::App& app, int& exit_status);
void add_recover(CLI::App& app, int& exit_status);
void add_recorder_of_proof(CLI::App& app, int& exit_status);
void add_import(CLI::App& app, int& exit_status);
void add_rig(CLI::App& app, int& exit_status);
void add_arm(CLI::App& app, int& exit_status);
void add_session(CLI::App& app, int& exit_status);
void add_shell(CLI::App& app, int& exit_status);
void add_simulator(CLI::App& app, int& exit_status);
void add_simulate_devices(CLI::App& app, int& exit_status);
void add_soak(CLI::App& app, int& exit_status);
void add_watch(CLI::App& app, int& exit_status);

// In the order in which --help lists them: of `selvedge`, `selvedge-sim` and `selvedge-verify`.
const std::vector<AddCommand>& lab_commands();
const std::vector<AddCommand>& simulation_commands();
const std::vector<AddCommand>& verify_commands();

}  // namespace selvedge::cli
