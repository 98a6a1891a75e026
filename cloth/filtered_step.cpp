#include "cloth/filtered_step.h"

#include "cloth/kernel/vertex_parts.h"

namespace selvedge::cloth {

FilteredStep::FilteredStep(const Sheet& sheet, const Experiment& experiment,
                           const std::vector<kernel::HeldVertex>& held) {
  filter_ = step_filter_of(experiment);
  if (!filter_) return;
  inverse_mass_ = kernel::vertex_masses(sheet.data, experiment.material);
  for (double& value : inverse_mass_) value = 1 / value;
  for (const kernel::HeldVertex& h : held) inverse_mass_[static_cast<size_t>(h.vertex)] = 0;
}

void FilteredStep::apply(double start_s, double step_s, const double* before, double* after, double* velocity) const {
  if (filter_) filter_({start_s, step_s, step_s, inverse_mass_.size(), before, after, velocity, inverse_mass_.data()});
}

}  // namespace selvedge::cloth
