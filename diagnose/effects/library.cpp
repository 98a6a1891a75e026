#include "diagnose/effects/library.h"

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

}  // namespace selvedge::diagnose
