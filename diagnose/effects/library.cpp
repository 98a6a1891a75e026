#include "diagnose/effects/library.h"

#include <algorithm>

#include "files/bad_input.h"

namespace selvedge::diagnose {

namespace effects {
#define SELVEDGE_EFFECT(name) Effect name();
#include "effect_table.inc"
#undef SELVEDGE_EFFECT
}  // namespace effects

const std::vector<Effect>& effect_library() {
  static const std::vector<Effect> all = {
#define SELVEDGE_EFFECT(name) effects::name(),
#include "effect_table.inc"
#undef SELVEDGE_EFFECT
  };
  return all;
}

std::vector<Effect> chosen_effects(const std::vector<std::string>& names, const std::vector<std::string>& without,
                                   const std::string& where) {
  const auto has = [](const std::vector<std::string>& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  std::vector<Effect> out;
  std::vector<std::string> unknown = names;
  unknown.insert(unknown.end(), without.begin(), without.end());
  std::string known;
  for (const Effect& effect : effect_library()) {
    known += (known.empty() ? "" : ", ") + effect.name;
    unknown.erase(std::remove(unknown.begin(), unknown.end(), effect.name), unknown.end());
    if ((names.empty() || has(names, effect.name)) && !has(without, effect.name)) out.push_back(effect);
  }
  if (!unknown.empty()) refuse(where, "found {}, expected some of {}", unknown[0], known);
  return out;
}

}  // namespace selvedge::diagnose
