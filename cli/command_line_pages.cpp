#include "cli/command_line_pages.h"

#include <algorithm>
#include <cctype>
#include <functional>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace selvedge::cli {

namespace {

using CLI::App;
using CLI::Option;

// Those that --help lists.
std::vector<const App*> shown_commands(const App& app) {
  return app.get_subcommands(std::function<bool(const App*)>(
      [](const App* sub) { return !sub->get_name().empty() && !sub->get_group().empty(); }));
}

std::vector<const Option*> shown_options(const App& app, bool positional) {
  return app.get_options(std::function<bool(const Option*)>(
      [positional](const Option* o) { return o->get_positional() == positional && !o->get_group().empty(); }));
}

bool takes_value(const Option& option) { return option.get_items_expected_max() > 0; }

std::vector<std::string> names_of(const Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

// CLI11 describes the words that are allowed as "{one,two}" at the end of the type's name.
std::vector<std::string> words_of(const Option& option) {
  const std::string type = option.get_type_name();
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

// Every command with its path: "", "session", "session run".
void for_each_command(const App& app, const std::string& path,
                      const std::function<void(const App&, const std::string&)>& visit) {
  visit(app, path);
  for (const App* sub : shown_commands(app))
    for_each_command(*sub, path.empty() ? sub->get_name() : path + " " + sub->get_name(), visit);
}

// How the words of one command are completed, as a branch of the script's case.
std::string completion_branch(const App& app, const std::string& path) {
  std::vector<std::string> commands, options, valued, positional;
  for (const App* sub : shown_commands(app)) commands.push_back(sub->get_name());
  std::string choices;
  for (const Option* option : shown_options(app, false)) {
    const std::vector<std::string> names = names_of(*option);
    options.insert(options.end(), names.begin(), names.end());
    if (!takes_value(*option)) continue;
    valued.insert(valued.end(), names.begin(), names.end());
    if (const auto words = words_of(*option); !words.empty())
      choices += fmt::format("        {}) values='{}' ;;\n", fmt::join(names, "|"), fmt::join(words, " "));
  }
  for (const Option* option : shown_options(app, true))
    for (const std::string& word : words_of(*option)) positional.push_back(word);
  std::string branch = fmt::format("    '{}')\n      commands='{}' options='{}' valued='{}' words='{}'\n", path,
                                   fmt::join(commands, " "), fmt::join(options, " "), fmt::join(valued, " "),
                                   fmt::join(positional, " "));
  if (!choices.empty()) branch += "      case $previous in\n" + choices + "      esac\n";
  return branch + "      ;;\n";
}

constexpr const char* kCompletionEnd = R"(  esac
}

_selvedge() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} path= i
  local commands options valued words values
  COMPREPLY=()
  # bash splits --option=value at the sign.
  [ "$current" = = ] && current=
  [ "$previous" = = ] && previous=${COMP_WORDS[COMP_CWORD-2]}
  _selvedge_knows ''
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case " $valued " in *" ${COMP_WORDS[i-1]} "*) continue ;; esac
    case " $commands " in *" ${COMP_WORDS[i]} "*) path=${path:+$path }${COMP_WORDS[i]}; _selvedge_knows "$path" ;; esac
  done
  _selvedge_knows "$path"
  case " $valued " in *" $previous "*) COMPREPLY=($(compgen -W "$values" -- "$current")); return ;; esac
  case $current in
    -*) COMPREPLY=($(compgen -W "$options" -- "$current")) ;;
    *) COMPREPLY=($(compgen -W "$commands $words" -- "$current")) ;;
  esac
}

complete -o bashdefault -o default -F _selvedge selvedge
)";

// Text as roff takes it: no line begins a request, what is not ASCII by its code point, hyphens as typed ones.
std::string roff(const std::string& text) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c == '\\') out += "\\e";
    else if (c == '-') out += "\\-";
    else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) out += std::string("\\&") + text[i];
    else if (c < 0x80) out += text[i];
    else {
      const int more = c >= 0xf0 ? 3 : c >= 0xe0 ? 2 : 1;
      unsigned code = c & (0x3f >> more);
      for (int k = 0; k < more && i + 1 < text.size(); ++k)
        code = code << 6 | (static_cast<unsigned char>(text[++i]) & 0x3f);
      out += fmt::format("\\[u{:04X}]", code);
    }
  }
  return out;
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

// What stands for a value: the words that are allowed, or the type.
std::string value_of(const Option& option) {
  const std::vector<std::string> words = words_of(option);
  if (!words.empty()) return roff(fmt::format("{}", fmt::join(words, "|")));
  const std::string type = option.get_type_name();
  return "\\fI" + roff(type.substr(0, type.find(':'))) + "\\fR";
}

std::string option_entry(const Option& option) {
  std::string entry = ".TP\n";
  if (option.get_positional()) {
    entry += "\\fI" + roff(upper(option.get_name(true))) + "\\fR";
    if (!words_of(option).empty()) entry += ": " + value_of(option);
  } else {
    const std::vector<std::string> names = names_of(option);
    for (size_t i = 0; i < names.size(); ++i) entry += (i == 0 ? "\\fB" : ", \\fB") + roff(names[i]) + "\\fR";
    if (takes_value(option)) entry += " " + value_of(option);
  }
  const std::string& fallback = option.get_default_str();
  entry += "\n" + roff(option.get_description());
  // A path of the machine where the page was written says nothing on another.
  if (!fallback.empty() && fallback.front() != '/') entry += roff(fmt::format(" (default: {})", fallback));
  return entry + (option.get_required() && !option.get_positional() ? "; required\n" : "\n");
}

// "session run [OPTIONS] FILE".
std::string synopsis(const App& app, const std::string& path) {
  std::string line = "\\fBselvedge " + roff(path) + "\\fR [\\fIOPTIONS\\fR]";
  for (const Option* option : shown_options(app, true)) {
    const std::string name = "\\fI" + roff(upper(option->get_name(true))) + "\\fR";
    line += option->get_required() ? " " + name : " [" + name + "]";
  }
  return line + "\n";
}

std::string command_section(const App& app, const std::string& path) {
  std::string text =
      fmt::format(".SS {}\n", roff(path)) + synopsis(app, path) + ".PP\n" + roff(app.get_description()) + ".\n";
  for (const bool positional : {true, false})
    for (const Option* option : shown_options(app, positional))
      if (option->get_name() != "--help") text += option_entry(*option);
  return text;
}

}  // namespace

std::string bash_completion(const App& app) {
  std::string script =
      "# Completion of selvedge's command line for bash, written by `selvedge completion bash`.\n"
      "_selvedge_knows() {\n  commands= options= valued= words= values=\n  case $1 in\n";
  for_each_command(app, "", [&](const App& one, const std::string& path) { script += completion_branch(one, path); });
  return script + kCompletionEnd;
}

std::string man_page(const App& app) {
  std::string page = fmt::format(".TH SELVEDGE 1 \"\" \"selvedge {}\" \"User Commands\"\n", roff(SELVEDGE_VERSION));
  page +=
      ".SH NAME\nselvedge \\- records fabric in motion, fits a simulated fabric to it, and says why the two differ\n";
  page += ".SH SYNOPSIS\n.B selvedge\n\\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n";
  page += ".SH DESCRIPTION\n" + roff(app.get_description()) +
          "\n.PP\nEvery command says its options with \\fB\\-\\-help\\fR.\n.SH COMMANDS\n";
  for_each_command(app, "", [&](const App& one, const std::string& path) {
    if (!path.empty() && shown_commands(one).empty()) page += command_section(one, path);
  });
  page += ".SH EXIT STATUS\n.TP\n0\ndone\n.TP\n1\nfailed, or a figure fell short\n.TP\n2\ninput that you can mend\n";
  return page;
}

}  // namespace selvedge::cli
