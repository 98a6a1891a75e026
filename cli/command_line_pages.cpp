#include "cli/command_line_pages.h"

#include <algorithm>
#include <cctype>
#include <functional>
#include <vector>

#include <fmt/format.h>

namespace selvedge::cli {

namespace {

// Every command with its path: "", "session", "session run".
void for_each_command(const CommandTree& command, const std::string& path,
                      const std::function<void(const CommandTree&, const std::string&)>& visit) {
  visit(command, path);
  for (const CommandTree& sub : command.commands)
    for_each_command(sub, path.empty() ? sub.name : path + " " + sub.name, visit);
}

// How the words of one command are completed, as a branch of the script's case.
std::string completion_branch(const CommandTree& command, const std::string& path) {
  std::vector<std::string> commands, options, valued, positional;
  for (const CommandTree& sub : command.commands) commands.push_back(sub.name);
  std::string choices;
  for (const CommandOption& option : command.options) {
    if (option.positional) {
      positional.insert(positional.end(), option.words.begin(), option.words.end());
      continue;
    }
    options.insert(options.end(), option.names.begin(), option.names.end());
    if (!option.takes_value) continue;
    valued.insert(valued.end(), option.names.begin(), option.names.end());
    if (!option.words.empty())
      choices +=
          fmt::format("        {}) values='{}' ;;\n", fmt::join(option.names, "|"), fmt::join(option.words, " "));
  }
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

// One of these words; a line may end behind each stroke.
std::string choices(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : "|\\:") + roff(word);
  return out;
}

// What stands for a value: the words that are allowed, or the type.
std::string value_of(const CommandOption& option) {
  if (!option.words.empty()) return choices(option.words);
  return "\\fI" + roff(option.type) + "\\fR";
}

std::string option_entry(const CommandOption& option) {
  std::string entry = ".TP\n";
  if (option.positional) {
    entry += "\\fI" + roff(upper(option.names.at(0))) + "\\fR";
    if (!option.words.empty()) entry += ": " + value_of(option);
  } else {
    for (size_t i = 0; i < option.names.size(); ++i)
      entry += (i == 0 ? "\\fB" : ", \\fB") + roff(option.names[i]) + "\\fR";
    if (option.takes_value) entry += " " + value_of(option);
  }
  entry += "\n" + roff(option.description);
  // A path of the machine where the page was written says nothing on another.
  if (!option.fallback.empty() && option.fallback.front() != '/')
    entry += roff(fmt::format(" (default: {})", option.fallback));
  return entry + (option.required && !option.positional ? "; required\n" : "\n");
}

// "session run [OPTIONS] FILE".
std::string synopsis(const CommandTree& command, const std::string& path) {
  std::string line = "\\fBselvedge " + roff(path) + "\\fR [\\fIOPTIONS\\fR]";
  for (const CommandOption& option : command.options) {
    if (!option.positional) continue;
    const std::string name = "\\fI" + roff(upper(option.names.at(0))) + "\\fR";
    line += option.required ? " " + name : " [" + name + "]";
  }
  return line + "\n";
}

std::string command_section(const CommandTree& command, const std::string& path) {
  std::string text =
      fmt::format(".SS {}\n", roff(path)) + synopsis(command, path) + ".PP\n" + roff(command.description) + ".\n";
  for (const bool positional : {true, false})
    for (const CommandOption& option : command.options)
      if (option.positional == positional && option.names.back() != "--help") text += option_entry(option);
  return text;
}

}  // namespace

std::string bash_completion(const CommandTree& commands) {
  std::string script =
      "# Completion of selvedge's command line for bash, written by `selvedge completion bash`.\n"
      "_selvedge_knows() {\n  commands= options= valued= words= values=\n  case $1 in\n";
  for_each_command(commands, "",
                   [&](const CommandTree& one, const std::string& path) { script += completion_branch(one, path); });
  return script + kCompletionEnd;
}

std::string man_page(const CommandTree& commands) {
  std::string page = fmt::format(".TH SELVEDGE 1 \"\" \"selvedge {}\" \"User Commands\"\n", roff(SELVEDGE_VERSION));
  page +=
      ".SH NAME\nselvedge \\- records fabric in motion, fits a simulated fabric to it, and says why the two differ\n";
  page += ".SH SYNOPSIS\n.B selvedge\n\\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n";
  page += ".SH DESCRIPTION\n" + roff(commands.description) +
          "\n.PP\nEvery command says its options with \\fB\\-\\-help\\fR.\n.SH COMMANDS\n";
  for_each_command(commands, "", [&](const CommandTree& one, const std::string& path) {
    if (!path.empty() && one.commands.empty()) page += command_section(one, path);
  });
  page += ".SH EXIT STATUS\n.TP\n0\ndone\n.TP\n1\nfailed, or a figure fell short\n.TP\n2\ninput that you can mend\n";
  return page;
}

}  // namespace selvedge::cli
