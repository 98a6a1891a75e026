// A campaign under the base model, as Python holds it: values by name in, residuals a trial out.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "model/simulation.h"
#include "python/arrays.h"

namespace selvedge::python {

struct CampaignSimulation {
  std::shared_ptr<const model::Simulation> simulation;
  std::vector<model::Parameter> parameters;
  std::shared_ptr<std::atomic<bool>> stop;  // of its trials: Ctrl-C in one thread ends what others ask of it, too

  // Of a dict by name (what it lacks is at its usual value), or of one number a parameter in their order. Throws
  // BadInput naming the parameter.
  Eigen::VectorXd coordinates(const py::object& values) const;
  py::dict values(const Eigen::VectorXd& coordinates) const;
  size_t trial(const std::string& name) const;  // throws BadInput where there is none
  // A dict from each trial's name.
  template <class Of>
  py::dict by_trial(const Of& of) const {
    py::dict out;
    for (size_t i = 0; i < simulation->trials().size(); ++i) out[py::str(simulation->trials()[i].name)] = of(i);
    return out;
  }
};

}  // namespace selvedge::python
