// What the programs' main() share: processor, command line, errors. Exit status: 0 done, 1 failed (or a figure fell
// short), 2 input that the user can mend.
#pragma once

#include "cli/command.h"

namespace selvedge::cli {

// One that asks_siblings lists their commands in its --help, and becomes them for a command that is theirs.
int run_program(const std::vector<AddCommand>& commands, bool asks_siblings, int argc, char** argv);

}  // namespace selvedge::cli
