// The compiled part of the Python module `selvedge`.
#include <pybind11/pybind11.h>

#include "files/bad_input.h"
#include "library/version.h"
#include "python/bindings.h"

PYBIND11_MODULE(_core, module) {
  // Classes and errors are selvedge's, whichever file holds them.
  const pybind11::object own_name = module.attr("__name__");
  module.attr("__name__") = "selvedge";
  pybind11::register_exception<selvedge::BadInput>(module, "BadInput", PyExc_ValueError).doc() =
      "Input that you can mend: file or argument, key, what was found, what was expected.";
  module.attr("__version__") = selvedge::version();
  selvedge::python::bind_trials(module);
  selvedge::python::bind_cloth(module);
  selvedge::python::bind_residuals(module);
  selvedge::python::bind_calibration(module);
  module.attr("__name__") = own_name;
}
