// The bank's worlds: three ways to simulate a swatch, which share neither discretisation nor strain measure, integrator
// or law of the air with one another (docs/decisions/0029-three-worlds.md), nor any code with cloth/.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hardware_sim/sheets/swatch_sheet.h"
#include "hardware_sim/world/lattice_sheet.h"

namespace selvedge::hardware_sim {

enum class BankWorld { lattice, sliding, elements };
const std::vector<std::string>& bank_world_names();
// Throws std::invalid_argument for a name that is none of these.
BankWorld bank_world(const std::string& name);
const char* to_text(BankWorld world);

// effects: names and sizes of what the fabric has beyond its base (fabric_extras.h, hidden_effects/).
std::unique_ptr<SwatchSheet> make_swatch(BankWorld world, const FabricTruth& truth, const SwatchOptions& options,
                                         const std::vector<std::pair<std::string, double>>& effects);

}  // namespace selvedge::hardware_sim
