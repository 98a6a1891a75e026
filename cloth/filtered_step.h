// Contact for integrators outside the lanes: hands a finished step of one run to the experiment's step filter.
#pragma once

#include <vector>

#include "cloth/simulate.h"

namespace selvedge::cloth {

class FilteredStep {
 public:
  // Without a filter in the experiment, apply() changes nothing.
  FilteredStep(const Sheet& sheet, const Experiment& experiment, const std::vector<kernel::HeldVertex>& held);

  // 3N each: positions at start_s and after the step, m, and the velocity to go on with, m/s.
  void apply(double start_s, double step_s, const double* before, double* after, double* velocity) const;

 private:
  kernel::StepFilter filter_;
  std::vector<double> inverse_mass_;
};

}  // namespace selvedge::cloth
