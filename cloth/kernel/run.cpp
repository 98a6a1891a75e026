#include "cloth/kernel/run.h"

#include "cloth/kernel/run_lanes.h"

namespace selvedge::cloth::kernel {

int most_lanes() { return lanes_of<WidestLanes>; }

RunOutput run(const RunInput& input) {
  if (input.lanes == 1) return run_lanes<Quad>(input);
  return input.lanes <= lanes_of<Lanes4> ? run_lanes<Vec3<Lanes4>>(input) : run_lanes<Vec3<WidestLanes>>(input);
}

RelaxOutput relax(const RunInput& input, const RelaxOptions& options) {
  if (input.lanes == 1) return relax_lanes<Quad>(input, options);
  return input.lanes <= lanes_of<Lanes4> ? relax_lanes<Vec3<Lanes4>>(input, options)
                                         : relax_lanes<Vec3<WidestLanes>>(input, options);
}

}  // namespace selvedge::cloth::kernel
