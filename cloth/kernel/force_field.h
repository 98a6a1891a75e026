// Accelerations of one run in plain doubles, for integrators outside the lanes.
#pragma once

#include <memory>
#include <vector>

#include "cloth/kernel/sheet_data.h"

namespace selvedge::cloth::kernel {

// In the place of a step: memories of friction and creep become those of a sheet that was brought from flat to where it
// is now, each strain and curvature growing all the way, and hung there long enough to creep to the end.
inline constexpr double kBroughtFromFlat = -1;

class Forces;

class ForceField {
 public:
  ForceField(const SheetData& sheet, const Material& material, const Surroundings& surroundings,
             const std::vector<HeldVertex>& held = {});
  ~ForceField();

  // position, velocity: 3N, vertex by vertex; acceleration: 3N, m/s². memory_step_s: advances friction and
  // creep; 0 leaves them, kBroughtFromFlat sets them to those of a sheet brought here from flat.
  void accelerations(const double* position, const double* velocity, double memory_step_s, double* acceleration);

 private:
  std::unique_ptr<Forces> forces_;
};

}  // namespace selvedge::cloth::kernel
