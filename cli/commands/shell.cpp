// ./selvedge completion bash, and ./selvedge man: the command line for a shell and for man(1).
#include <string>

#include <fmt/format.h>

#include "cli/command.h"
#include "cli/command_line_pages.h"

namespace selvedge::cli {

void add_shell(CLI::App& app, int&) {
  auto* completion =
      app.add_subcommand("completion", "print a completion script; for this shell: source <(selvedge completion bash)");
  completion->add_option("SHELL", "the shell that is to complete")->required()->check(CLI::IsMember({"bash"}));
  completion->callback([&app] { fmt::print("{}", bash_completion(app)); });
  auto* man = app.add_subcommand("man", "print the manual page; to read it: selvedge man | man -l -");
  man->callback([&app] { fmt::print("{}", man_page(app)); });
}

}  // namespace selvedge::cli
