#include "report/verdict.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

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

std::string to_lines(const Verdict& verdict) {
  std::string text = fmt::format("{}: {}\n", to_text(verdict.trust), verdict.sentence);
  for (const std::string& why : verdict.because) text += "  because " + why + "\n";
  return text;
}

nlohmann::json to_json(const Verdict& verdict) {
  return {{"trust", to_text(verdict.trust)}, {"sentence", verdict.sentence}, {"because", verdict.because}};
}

}  // namespace selvedge::report
