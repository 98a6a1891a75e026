#include "cloth/kernel/force_field.h"

#include "cloth/kernel/acceleration.h"

namespace selvedge::cloth::kernel {

struct ForceField::Parts {
  const SheetData& sheet;
  Materials<Quad> materials;
  Workspace<Quad> work;
};

ForceField::ForceField(const SheetData& sheet, const Material& material, const Surroundings& surroundings,
                       const std::vector<HeldVertex>& held)
    : parts_(
          new Parts{sheet, unpack_materials<Quad>(sheet, &material, &surroundings, 1, held), Workspace<Quad>(sheet)}) {}

ForceField::~ForceField() = default;

void ForceField::accelerations(const double* position, const double* velocity, double memory_step_s,
                               double* acceleration) {
  Workspace<Quad>& w = parts_->work;
  for (size_t i = 0; i < w.x.size(); ++i) {
    set_run(w.x[i], 0, position[3 * i], position[3 * i + 1], position[3 * i + 2]);
    set_run(w.v[i], 0, velocity[3 * i], velocity[3 * i + 1], velocity[3 * i + 2]);
  }
  kernel::accelerations(parts_->sheet, parts_->materials, w, memory_step_s);
  for (size_t i = 0; i < w.x.size(); ++i) store_run(w.acceleration[i], 0, acceleration + 3 * i);
}

}  // namespace selvedge::cloth::kernel
