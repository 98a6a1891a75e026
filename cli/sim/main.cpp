// `selvedge-sim`: the simulated devices, the worlds that they share, and the demo on them.
#include "cli/run_program.h"

int main(int argc, char** argv) {
  return selvedge::cli::run_program(selvedge::cli::simulation_commands(), false, argc, argv);
}
