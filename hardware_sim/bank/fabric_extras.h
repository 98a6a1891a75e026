// What the bank's world can give a fabric beyond its base: each has the name of the exchange format's effect, but
// its own form, by intention another than the model's (a chain of sliders where the model has Dahl's law, a
// cubic where it has an absolute value, a strip of nodes where it has a smooth share).
#pragma once

#include <map>
#include <memory>
#include <string>

#include "hardware_sim/world/lattice_sheet.h"

namespace selvedge::hardware_sim {

struct Extra {
  std::shared_ptr<LatticeExtra> extra;
  double step_share = 1;  // of the step of a sheet without it
};

// size: in the effect's usual unit, see the .cpp. Throws std::invalid_argument for a name that is none of these.
Extra fabric_extra(const std::string& name, double size);

}  // namespace selvedge::hardware_sim
