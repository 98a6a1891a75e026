// The command line as plain data: what --help, completion and manual page show of it. A program hands its own to
// another as JSON (`--command-tree`), so that each command is described once, in the program that runs it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace selvedge::cli {

struct CommandOption {
  std::vector<std::string> names;  // "-h", "--help"; of a positional its one name
  std::string description;
  std::string type;                // of its value: "PATH"
  std::vector<std::string> words;  // those that are allowed; empty: any
  std::string fallback;            // what it is where it is not given
  bool positional = false, required = false, takes_value = false;
};

struct CommandTree {
  std::string name, description;
  std::vector<CommandOption> options;
  std::vector<CommandTree> commands;
};

// Of what --help shows.
CommandTree command_tree(const CLI::App& app);

nlohmann::json to_json(const CommandTree& tree);
// Throws std::exception where value is not what to_json makes.
CommandTree command_tree_from(const nlohmann::json& value);

}  // namespace selvedge::cli
