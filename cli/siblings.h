// The other programs of the same build, and their commands, as `selvedge` offers them: it asks each that is installed
// what it knows and becomes it when one of its commands is called. No list of their commands is kept here.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/command_tree.h"

namespace selvedge::cli {

struct Sibling {
  std::string program, path;
  CommandTree commands;
};

// Those that are installed, in the order in which --help lists them; asks each (some tens of milliseconds). Throws
// std::runtime_error where one does not answer.
std::vector<Sibling> installed_siblings();

// Names of those that are not installed.
std::vector<std::string> missing_siblings();

// The one that has the command; nullopt: none.
std::optional<Sibling> sibling_for(const std::string& command);

// Becomes the installed program that has the command argv[1]. Returns where none has it.
void become_sibling_for(char** argv);

// The commands of `selvedge` and of the installed siblings behind them, as completion and manual page list them;
// programs: of these alone; empty: of all. Throws BadInput for one that is not installed.
CommandTree with_siblings(CommandTree own, const std::vector<std::string>& programs);

}  // namespace selvedge::cli
