// What each source of the module adds to it.
#pragma once

#include <pybind11/pybind11.h>

namespace selvedge::python {

void bind_trials(pybind11::module_& module);       // trials and campaigns on disk
void bind_cloth(pybind11::module_& module);        // fabrics, and simulating them
void bind_residuals(pybind11::module_& module);    // a campaign under parameters
void bind_calibration(pybind11::module_& module);  // fit and diagnosis

}  // namespace selvedge::python
