// `selvedge`: what a lab uses. It links no simulated world, no peer and no proof; it becomes its siblings for theirs.
#include "cli/run_program.h"

int main(int argc, char** argv) { return selvedge::cli::run_program(selvedge::cli::lab_commands(), true, argc, argv); }
