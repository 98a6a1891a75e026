// How far an answer is to be trusted: the first line of a report and of a command's output. It falls wherever the
// answer's own documents say not to believe it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace selvedge::report {

enum class Trust { full, limited, none };

// "to be believed", "to be taken with care", "not to be believed".
const char* to_text(Trust trust);

struct Verdict {
  Trust trust = Trust::full;
  std::string sentence;              // the answer in plain words
  std::vector<std::string> because;  // why it is trusted no further; empty where trust is full

  // Lowers trust to this, where it stands higher, and says why.
  void lower(Trust to, const std::string& why);
};

// For a terminal: one line, then one a reason. coloured: green, yellow or red, as ANSI escapes.
std::string to_lines(const Verdict& verdict, bool coloured = false);

// The same for standard output: coloured where that is a terminal and NO_COLOR is not set.
std::string for_terminal(const Verdict& verdict);

// {"trust", "sentence", "because"}.
nlohmann::json to_json(const Verdict& verdict);

// What to_json made; none where the value is no such thing.
std::optional<Verdict> read_verdict(const nlohmann::json& value);

}  // namespace selvedge::report
