#include "cloth/kernel/force_field.h"

#include <cstring>

#include "cloth/kernel/acceleration.h"

namespace selvedge::cloth::kernel {

struct ForceField::Parts {
  const SheetData& sheet;
  LaneMaterial<double> material;
  Workspace<double> work;
};

ForceField::ForceField(const SheetData& sheet, const Material& material, const Surroundings& surroundings)
    : parts_(new Parts{sheet, unpack<double>(sheet, &material, &surroundings, 1), Workspace<double>(sheet)}) {}

ForceField::~ForceField() = default;

void ForceField::accelerations(const double* position, const double* velocity, double memory_step_s,
                               double* acceleration) {
  const size_t bytes = parts_->work.x.size() * sizeof(Vec3<double>);
  std::memcpy(parts_->work.x.data(), position, bytes);
  std::memcpy(parts_->work.v.data(), velocity, bytes);
  kernel::accelerations(parts_->sheet, parts_->material, parts_->work, memory_step_s);
  std::memcpy(acceleration, parts_->work.force.data(), bytes);
}

}  // namespace selvedge::cloth::kernel
