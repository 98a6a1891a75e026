#include "hardware_sim/bank/named_extra.h"

#include <stdexcept>

#include "files/bad_input.h"
#include "hardware_sim/hidden_effects/hidden_effect.h"

namespace selvedge::hardware_sim {

Extra named_extra(const std::string& name, double size, const std::string& where) {
  for (const HiddenEffect& effect : hidden_effects())
    if (effect.name == name) return {effect.make(size), effect.step_share};
  try {
    return fabric_extra(name, size);
  } catch (const std::invalid_argument&) {
    std::string hidden;
    for (const HiddenEffect& effect : hidden_effects()) hidden += ", " + effect.name;
    refuse(where,
           "found {}, expected one of anisotropy, coupling, stretch_stiffening, bend_nonlinearity, rest_curvature, "
           "bend_friction, "
           "stretch_friction, creep, hem, added_mass, local_mass{}",
           in_quotes(name), hidden);
  }
}

}  // namespace selvedge::hardware_sim
