#include "cloth/kernel/run.h"

#include "cloth/kernel/run_lanes.h"

namespace selvedge::cloth::kernel {

RunOutput run(const RunInput& input) {
  return input.lanes == 1 ? run_lanes<Quad>(input) : run_lanes<Vec3<Lanes4>>(input);
}

RelaxOutput relax(const RunInput& input, const RelaxOptions& options) {
  return input.lanes == 1 ? relax_lanes<Quad>(input, options) : relax_lanes<Vec3<Lanes4>>(input, options);
}

}  // namespace selvedge::cloth::kernel
