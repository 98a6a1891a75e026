#include "report/verdict.h"

#include <algorithm>
#include <cstdlib>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

namespace selvedge::report {

const char* to_text(Trust trust) {
  switch (trust) {
    case Trust::full: return "to be believed";
    case Trust::limited: return "to be taken with care";
    case Trust::none: return "not to be believed";
  }
  return "";
}

void Verdict::lower(Trust to, const std::string& why) {
  trust = std::max(trust, to);
  because.push_back(why);
}

std::string to_lines(const Verdict& verdict, bool coloured) {
  constexpr const char* colours[] = {"\x1b[32m", "\x1b[33m", "\x1b[31m"};
  const char* const colour = coloured ? colours[static_cast<size_t>(verdict.trust)] : "";
  std::string text =
      fmt::format("{}{}{}: {}\n", colour, to_text(verdict.trust), coloured ? "\x1b[0m" : "", verdict.sentence);
  for (const std::string& why : verdict.because) text += "  because " + why + "\n";
  return text;
}

std::string for_terminal(const Verdict& verdict) {
  return to_lines(verdict, ::isatty(STDOUT_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr);
}

nlohmann::json to_json(const Verdict& verdict) {
  return {{"trust", to_text(verdict.trust)}, {"sentence", verdict.sentence}, {"because", verdict.because}};
}

std::optional<Verdict> read_verdict(const nlohmann::json& value) {
  if (!value.is_object() || !value.contains("sentence") || !value["sentence"].is_string()) return std::nullopt;
  for (const Trust trust : {Trust::full, Trust::limited, Trust::none}) {
    if (value.value("/trust"_json_pointer, nlohmann::json()) != nlohmann::json(to_text(trust))) continue;
    Verdict verdict{trust, value["sentence"].get<std::string>(), {}};
    for (const nlohmann::json& why : value.value("because", nlohmann::json::array()))
      if (why.is_string()) verdict.because.push_back(why.get<std::string>());
    return verdict;
  }
  return std::nullopt;
}

}  // namespace selvedge::report
