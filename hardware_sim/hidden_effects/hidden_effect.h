// What only the simulated world knows: effects that no diagnosis has in its library, so that its right answer is
// `unknown`. One a file; diagnose/ never links them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "hardware_sim/world/lattice_sheet.h"

namespace selvedge::hardware_sim {

struct HiddenEffect {
  std::string name;
  // strength 1: as plain as the library's effects of usual size.
  std::shared_ptr<LatticeExtra> (*make)(double strength);
  double step_share = 1;
};

HiddenEffect magnet();
HiddenEffect tied_thread();
HiddenEffect pulsing_air();
HiddenEffect stitched_line();

inline std::vector<HiddenEffect> hidden_effects() { return {magnet(), tied_thread(), pulsing_air(), stitched_line()}; }

}  // namespace selvedge::hardware_sim
