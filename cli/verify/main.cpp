// `selvedge-verify`: what Selvedge is held against: proofs, timings beside peers, soak runs, blind checks.
#include "cli/run_program.h"

int main(int argc, char** argv) {
  return selvedge::cli::run_program(selvedge::cli::verify_commands(), false, argc, argv);
}
