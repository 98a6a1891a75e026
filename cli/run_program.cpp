#include "cli/run_program.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <fmt/format.h>

#include "cli/command_tree.h"
#include "cli/siblings.h"
#include "cloth/kernel/processor.h"
#include "files/bad_input.h"
#include "files/nearest_name.h"
#include "report/html.h"

namespace selvedge::cli {

namespace {

int report_error(std::string text, int exit_status) {
  text = printable(text);  // whatever a file name or a library's message holds, and on one line
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  fmt::print(stderr, "selvedge: {}\n", text);
  return exit_status;
}

void set_up(CLI::App& app) {
  app.footer(
      "./selvedge test    sets up what is missing and runs every test.\n"
      "Exit status: 0 done, 1 failed or a figure fell short, 2 input that you can mend.");
  app.get_formatter()->column_width(30);
  app.set_version_flag("--version", "selvedge " SELVEDGE_VERSION);
  app.require_subcommand(0, 1);
  app.failure_message(CLI::FailureMessage::simple);
}

bool has_command(const CLI::App& app, const std::string& name) {
  return !app.get_subcommands([&](const CLI::App* sub) { return sub->get_name() == name; }).empty();
}

// For --help alone: their options are the siblings' own.
void list_siblings_commands(CLI::App& app) {
  for (const Sibling& sibling : installed_siblings())
    for (const CommandTree& command : sibling.commands.commands)
      app.add_subcommand(command.name, command.description)->group("Subcommands of " + sibling.program);
}

std::string what_is_not_installed(bool asks_siblings) {
  const auto missing = asks_siblings ? missing_siblings() : std::vector<std::string>();
  return missing.empty() ? "" : fmt::format("; not installed here, with its commands: {}", fmt::join(missing, ", "));
}

// Of what was written the first word that is neither a command nor an option, where one of these is near it; else
// nothing. Siblings' commands are asked for by their first word alone.
std::string what_was_meant(const CLI::App& app, bool asks_siblings, int argc, char** argv) {
  CommandTree at = command_tree(app);
  if (asks_siblings)
    for (const Sibling& sibling : installed_siblings())
      at.commands.insert(at.commands.end(), sibling.commands.commands.begin(), sibling.commands.commands.end());
  for (int i = 1; i < argc; ++i) {
    const std::string written = argv[i], name = written.substr(0, written.find('='));
    std::vector<std::string> known;
    if (name.starts_with("--")) {
      for (const CommandOption& o : at.options) known.insert(known.end(), o.names.begin(), o.names.end());
      if (std::find(known.begin(), known.end(), name) != known.end()) continue;
      return files::did_you_mean(name, known);
    }
    if (at.commands.empty()) continue;
    for (const CommandTree& c : at.commands) known.push_back(c.name);
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end()) return files::did_you_mean(name, known);
    const CommandTree next = at.commands[static_cast<size_t>(found - known.begin())];
    at = next;
  }
  return "";
}

// SELVEDGE_PROCESSOR: as if this processor had no more than that kind, to see what another machine computes.
void choose_processor() {
  const char* const kind = std::getenv("SELVEDGE_PROCESSOR");
  if (kind && !cloth::kernel::use_processor_kind(kind))
    refuse("SELVEDGE_PROCESSOR", "found {}, expected plain, avx2 or avx512, and a processor that has it",
           in_quotes(kind));
}

int parse(CLI::App& app, bool asks_siblings, int argc, char** argv) {
  const std::string first = argc > 1 ? argv[1] : "";
  if (first == "--command-tree") {
    fmt::print("{}\n", to_json(command_tree(app)).dump());
    return 0;
  }
  if (first == "--knows" && argc == 3) {  // asked by the script ./selvedge before it builds what would
    const std::string name = argv[2];
    const bool known = name.empty() || name.front() == '-' || has_command(app, name);
    return known || (asks_siblings && sibling_for(name)) ? 0 : 1;
  }
  if (asks_siblings && (first.empty() || first == "-h" || first == "--help")) list_siblings_commands(app);
  else if (asks_siblings && first.front() != '-' && !has_command(app, first)) become_sibling_for(argv);
  app.parse(argc, argv);
  if (app.get_subcommands().empty()) fmt::print("{}", app.help());
  return 0;
}

}  // namespace

int run_program(const std::vector<AddCommand>& commands, bool asks_siblings, int argc, char** argv) {
  std::string command_line = "./selvedge";
  for (int i = 1; i < argc; ++i) command_line += std::string(" ") + argv[i];
  report::set_command(printable(command_line));
  CLI::App app("Selvedge records fabric in motion, fits a simulated fabric to it, and says why the two differ.",
               "./selvedge");
  set_up(app);
  int exit_status = 0;
  for (const AddCommand add : commands) add(app, exit_status);
  try {
    choose_processor();
    const int status = parse(app, asks_siblings, argc, argv);
    return status != 0 ? status : exit_status;
  } catch (const CLI::Success& help) { return app.exit(help); } catch (const CLI::ParseError& error) {
    const std::string meant = what_was_meant(app, asks_siblings, argc, argv),
                      installed = dynamic_cast<const CLI::ExtrasError*>(&error) && meant.empty()
                                      ? what_is_not_installed(asks_siblings)
                                      : "";
    return report_error(error.what() + meant + installed + " (--help lists what there is)", 2);
  } catch (const BadInput& error) { return report_error(error.what(), 2); } catch (const std::exception& error) {
    return report_error(error.what(), 1);
  }
}

}  // namespace selvedge::cli
