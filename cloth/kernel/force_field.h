// Accelerations of one run in plain doubles, for integrators outside the lanes.
#pragma once

#include <memory>
#include <vector>

#include "cloth/kernel/sheet_data.h"

namespace selvedge::cloth::kernel {

class ForceField {
 public:
  ForceField(const SheetData& sheet, const Material& material, const Surroundings& surroundings,
             const std::vector<HeldVertex>& held = {});
  ~ForceField();

  // position, velocity: 3N, vertex by vertex; acceleration: 3N, m/s². memory_step_s: advances friction and
  // creep; 0 leaves them.
  void accelerations(const double* position, const double* velocity, double memory_step_s, double* acceleration);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace selvedge::cloth::kernel
