// Compiled once for each kind of processor; SELVEDGE_TRIANGLES is the name of its table's function (table.h).
#include "cloth/kernel/acceleration.h"
#include "cloth/kernel/run_lanes.h"
#include "cloth/kernel/table.h"

namespace selvedge::cloth::kernel {

namespace {

RunOutput run_here(const RunInput& input) {
  if (input.lanes == 1) return run_lanes<Quad>(input);
  return input.lanes <= lanes_of<Lanes4> ? run_lanes<Vec3<Lanes4>>(input) : run_lanes<Vec3<WidestLanes>>(input);
}

RelaxOutput relax_here(const RunInput& input, const RelaxOptions& options) {
  if (input.lanes == 1) return relax_lanes<Quad>(input, options);
  return input.lanes <= lanes_of<Lanes4> ? relax_lanes<Vec3<Lanes4>>(input, options)
                                         : relax_lanes<Vec3<WidestLanes>>(input, options);
}

class ForcesHere : public Forces {
 public:
  ForcesHere(const SheetData& sheet, const Material& material, const Surroundings& surroundings,
             const std::vector<HeldVertex>& held)
      : sheet_(sheet), materials_(unpack_materials<Quad>(sheet, &material, &surroundings, 1, held)), work_(sheet) {}

  void accelerations(const double* position, const double* velocity, double memory_step_s,
                     double* acceleration) override {
    for (size_t i = 0; i < work_.x.size(); ++i) {
      set_run(work_.x[i], 0, position[3 * i], position[3 * i + 1], position[3 * i + 2]);
      set_run(work_.v[i], 0, velocity[3 * i], velocity[3 * i + 1], velocity[3 * i + 2]);
    }
    kernel::accelerations(sheet_, materials_, work_, memory_step_s);
    for (size_t i = 0; i < work_.x.size(); ++i) store_run(work_.acceleration[i], 0, acceleration + 3 * i);
  }

 private:
  const SheetData& sheet_;
  Materials<Quad> materials_;
  Workspace<Quad> work_;
};

std::unique_ptr<Forces> forces_here(const SheetData& sheet, const Material& material, const Surroundings& surroundings,
                                    const std::vector<HeldVertex>& held) {
  return std::make_unique<ForcesHere>(sheet, material, surroundings, held);
}

}  // namespace

const KernelTable& SELVEDGE_TRIANGLES() {
  static const KernelTable table = {lanes_of<WidestLanes>, run_here, relax_here, forces_here};
  return table;
}

}  // namespace selvedge::cloth::kernel
