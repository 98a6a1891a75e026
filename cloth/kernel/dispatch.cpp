// The kernels of the processor that this runs on.
#include "cloth/kernel/force_field.h"
#include "cloth/kernel/processor.h"
#include "cloth/kernel/run.h"
#include "cloth/kernel/table.h"

namespace selvedge::cloth::kernel {

namespace {

const KernelTable& here() {
  switch (processor()) {
    case Processor::avx512: return avx512_triangles();
    case Processor::avx2: return avx2_triangles();
    default: return plain_triangles();
  }
}

}  // namespace

int most_lanes() { return here().most_lanes; }

RunOutput run(const RunInput& input) { return here().run(input); }

RelaxOutput relax(const RunInput& input, const RelaxOptions& options) { return here().relax(input, options); }

ForceField::ForceField(const SheetData& sheet, const Material& material, const Surroundings& surroundings,
                       const std::vector<HeldVertex>& held)
    : forces_(here().forces(sheet, material, surroundings, held)) {}

ForceField::~ForceField() = default;

void ForceField::accelerations(const double* position, const double* velocity, double memory_step_s,
                               double* acceleration) {
  forces_->accelerations(position, velocity, memory_step_s, acceleration);
}

}  // namespace selvedge::cloth::kernel
