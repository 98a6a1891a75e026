// ./selvedge completion bash, and ./selvedge man: the command line for a shell and for man(1).
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "cli/command.h"
#include "cli/command_line_pages.h"
#include "cli/siblings.h"

namespace selvedge::cli {

void add_shell(CLI::App& app, int&) {
  auto* completion =
      app.add_subcommand("completion", "print a completion script; for this shell: source <(selvedge completion bash)");
  completion->add_option("SHELL", "the shell that is to complete")->required()->check(CLI::IsMember({"bash"}));
  completion->callback([&app] { fmt::print("{}", bash_completion(with_siblings(command_tree(app), {}))); });
  auto* man = app.add_subcommand("man", "print the manual page; to read it: selvedge man | man -l -");
  auto programs = std::make_shared<std::vector<std::string>>();
  man->add_option("--of", *programs,
                  "commands of this program alone (selvedge, selvedge-sim …); default: of all that are installed");
  man->callback([&app, programs] { fmt::print("{}", man_page(with_siblings(command_tree(app), *programs))); });
}

}  // namespace selvedge::cli
