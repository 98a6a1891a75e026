// What a shell and man(1) want to know of the command line, written from the commands themselves, so that it is never
// stale.
#pragma once

#include <string>

#include "cli/command_tree.h"

namespace selvedge::cli {

// A script for bash: completes commands, their subcommands and options, and the words that an option or a positional
// takes where they are few; file names everywhere else. To be sourced, or put into bash-completion's folder as
// "selvedge".
std::string bash_completion(const CommandTree& commands);

// A manual page (roff, macros of man(7)): every command with its options.
std::string man_page(const CommandTree& commands);

}  // namespace selvedge::cli
