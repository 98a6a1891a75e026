#include "cloth/spline/derivatives.h"

#include "cloth/spline/settle.h"

namespace selvedge::cloth::spline {

Derivatives derivatives(const SplineSheet& sheet, const Experiment& experiment, const std::vector<Direction>& by,
                        const Options& options) {
  Experiment from = experiment;
  if (from.starts_at_rest) from.start_shape = settle(sheet, from, from.start_shape, options.rest_change_m).position;
  std::vector<Experiment> lanes = {from};
  for (const Direction& d : by) {
    lanes.push_back(from);
    lanes.back().material.*d.member += d.step;
  }
  Options alike = options;
  if (alike.step_s <= 0) alike.step_s = common_step_s(sheet, lanes, options);
  std::vector<Trajectory> motions = simulate(sheet, lanes, alike);
  Derivatives out;
  for (const Trajectory& t : motions) out.finite = out.finite && t.finite;
  for (size_t k = 0; k < by.size(); ++k) {
    std::vector<Eigen::Matrix3Xd>& samples = out.by.emplace_back();
    for (size_t s = 0; s < motions[0].samples.size(); ++s)
      samples.emplace_back((motions[k + 1].samples[s] - motions[0].samples[s]) / by[k].step);
  }
  out.motion = std::move(motions[0]);
  return out;
}

}  // namespace selvedge::cloth::spline
