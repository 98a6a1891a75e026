#include "cli/command_tree.h"

#include <utility>

namespace selvedge::cli {

namespace {

std::vector<std::string> names_of(const CLI::Option& option) {
  if (option.get_positional()) return {option.get_name(true)};
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

// CLI11 describes the words that are allowed as "{one,two}" at the end of the type's name.
std::vector<std::string> words_of(const std::string& type) {
  const size_t begin = type.find('{'), end = type.rfind('}');
  std::vector<std::string> words;
  if (begin == std::string::npos || end == std::string::npos) return words;
  std::string word;
  for (size_t i = begin + 1; i <= end; ++i) {
    if (type[i] != ',' && i != end) word += type[i];
    else words.push_back(std::exchange(word, ""));
  }
  return words;
}

CommandOption described(const CLI::Option& option) {
  CommandOption out;
  const std::string type = option.get_type_name();
  out.names = names_of(option);
  out.description = option.get_description();
  out.type = type.substr(0, type.find(':'));
  out.words = words_of(type);
  out.fallback = option.get_default_str();
  out.positional = option.get_positional();
  out.required = option.get_required();
  out.takes_value = option.get_items_expected_max() > 0;
  return out;
}

}  // namespace

CommandTree command_tree(const CLI::App& app) {
  CommandTree tree{app.get_name(), app.get_description(), {}, {}};
  const auto shown = [](const auto* part) { return !part->get_name().empty() && !part->get_group().empty(); };
  for (const CLI::Option* option : app.get_options(std::function<bool(const CLI::Option*)>(shown)))
    tree.options.push_back(described(*option));
  for (const CLI::App* sub : app.get_subcommands(std::function<bool(const CLI::App*)>(shown)))
    tree.commands.push_back(command_tree(*sub));
  return tree;
}

nlohmann::json to_json(const CommandTree& tree) {
  nlohmann::json options = nlohmann::json::array(), commands = nlohmann::json::array();
  for (const CommandOption& o : tree.options)
    options.push_back({{"names", o.names},
                       {"description", o.description},
                       {"type", o.type},
                       {"words", o.words},
                       {"default", o.fallback},
                       {"positional", o.positional},
                       {"required", o.required},
                       {"takes_value", o.takes_value}});
  for (const CommandTree& command : tree.commands) commands.push_back(to_json(command));
  return {{"name", tree.name}, {"description", tree.description}, {"options", options}, {"commands", commands}};
}

CommandTree command_tree_from(const nlohmann::json& value) {
  CommandTree tree{value.at("name"), value.at("description"), {}, {}};
  for (const nlohmann::json& o : value.at("options"))
    tree.options.push_back({o.at("names"), o.at("description"), o.at("type"), o.at("words"), o.at("default"),
                            o.at("positional"), o.at("required"), o.at("takes_value")});
  for (const nlohmann::json& command : value.at("commands")) tree.commands.push_back(command_tree_from(command));
  return tree;
}

}  // namespace selvedge::cli
