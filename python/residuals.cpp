// A campaign under parameters: residuals, their derivatives, motions.
#include <cmath>

#include "files/bad_input.h"
#include "fit/stages.h"
#include "model/trial_error.h"
#include "python/bindings.h"
#include "python/campaign_simulation.h"
#include "python/long_call.h"
#include "python/motion.h"
#include "python/sound_trial.h"

namespace selvedge::python {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Self = CampaignSimulation;
using State = std::optional<model::State>;

double value_of(const model::Parameter& p, const py::handle& given) {
  const double value = given.cast<double>();
  if (!std::isfinite(value) || (p.logarithmic && !(value > 0)))
    refuse(p.name, "found {}, expected a number{}", value, p.logarithmic ? " above 0" : "");
  return value;
}

Self made(const trial::Campaign& campaign, const std::string& drag, int cells, double rate_hz, double image_rate_hz,
          const py::object& progress) {
  expect_sound(campaign);
  if (cells < 4 || cells > 64) refuse("cells", "found {}, expected 4 to 64", cells);
  if (!(rate_hz > 0) || !(image_rate_hz > 0)) refuse("rate_hz, image_rate_hz", "expected numbers above 0");
  const model::Drag law = model::drag_named(drag);
  return long_call({"simulation of " + campaign.fabric, progress}, [&](LongCall& call) {
    const trial::Campaign rig = trial::only_tests(campaign, false);
    if (rig.trials.empty()) refuse("campaign", "found material tests alone, expected a fabric that hangs from a rig");
    model::SimulationOptions on;
    on.cells = cells;
    std::vector<model::ObservedTrial> seen = fit::observe_campaign(rig, rate_hz, image_rate_hz, call.progress());
    const auto stop = std::make_shared<std::atomic<bool>>(false);
    for (model::ObservedTrial& t : seen) t.experiment.stop = stop;
    return Self{std::make_shared<const model::Simulation>(std::move(seen), on), model::base_parameters(law), stop};
  });
}

model::State state_or(const Self& self, const State& state, const VectorXd& x) {
  return state ? *state : self.simulation->state_at(self.parameters, x);
}

VectorXd or_nan(const Self& self, size_t trial, const model::Residuals& r) {
  if (r.start[trial].cols() > 0) return r.mm[trial];
  return VectorXd::Constant(self.simulation->sd_mm(trial).size(), std::nan(""));
}

py::dict residuals(const Self& self, const py::object& values, const State& state, const py::object& progress) {
  const VectorXd x = self.coordinates(values);
  const model::Residuals r = long_call({"residuals", progress, self.stop}, [&](LongCall&) {
    return self.simulation->evaluate(state_or(self, state, x), self.parameters, x).front();
  });
  return self.by_trial([&](size_t i) { return or_nan(self, i, r); });
}

// Central differences, all sets side by side.
py::dict derivatives(const Self& self, const py::object& values, const State& state, double step,
                     const py::object& progress) {
  if (!(step > 0) || step > 1) refuse("step", "found {}, expected a change of ln(value) above 0 and up to 1", step);
  const VectorXd x = self.coordinates(values);
  const Index count = x.size();
  MatrixXd sets = x.replicate(1, 2 * count);
  for (Index k = 0; k < count; ++k) {
    sets(k, 2 * k) += step;
    sets(k, 2 * k + 1) -= step;
  }
  const std::vector<model::Residuals> r = long_call({"derivatives", progress, self.stop}, [&](LongCall&) {
    return self.simulation->evaluate(state_or(self, state, x), self.parameters, sets);
  });
  return self.by_trial([&](size_t i) {
    MatrixXd out(self.simulation->sd_mm(i).size(), count);
    for (Index k = 0; k < count; ++k)
      out.col(k) =
          (or_nan(self, i, r[static_cast<size_t>(2 * k)]) - or_nan(self, i, r[static_cast<size_t>(2 * k + 1)])) /
          (2 * step);
    return out;
  });
}

py::dict rms(const Self& self, const py::object& values, const State& state, const py::object& progress) {
  const VectorXd x = self.coordinates(values);
  const model::Residuals r = long_call({"error", progress, self.stop}, [&](LongCall&) {
    return self.simulation->evaluate(state_or(self, state, x), self.parameters, x).front();
  });
  return self.by_trial([&](size_t i) {
    return model::rms_mm(self.simulation->trials()[i], or_nan(self, i, r), self.simulation->time_s(i));
  });
}

Motion motion(const Self& self, const std::string& trial, const py::object& values, const State& state,
              const py::object& progress) {
  const size_t i = self.trial(trial);
  const VectorXd x = self.coordinates(values);
  return long_call({"motion of " + trial, progress, self.stop}, [&](LongCall&) {
    return Motion{std::make_shared<const cloth::spline::SplineSheet>(self.simulation->sheet()),
                  self.simulation->trials()[i].experiment.sample_s,
                  self.simulation->trajectory(state_or(self, state, x), self.parameters, x, i)};
  });
}

void bind_parameter(py::module_& m) {
  py::class_<model::Parameter>(m, "Parameter", "A parameter of the base model.")
      .def_readonly("name", &model::Parameter::name)
      .def_readonly("unit", &model::Parameter::unit)
      .def_readonly("start", &model::Parameter::start, "Its usual value.")
      .def_readonly("lower", &model::Parameter::lower, "Bounds of a fit.")
      .def_readonly("upper", &model::Parameter::upper)
      .def("__repr__", [](const model::Parameter& p) {
        return fmt::format("<selvedge.Parameter {}: {:g} {}, {:g} to {:g}>", p.name, p.start, p.unit, p.lower, p.upper);
      });
  py::class_<model::State>(m, "State",
                           "How a campaign's trials hang and are held: the same values and state always give the same\n"
                           "residuals. Simulation.state makes one.");
}

const char* simulation_doc =
    "A campaign's trials, ready to be simulated with any parameters of the base model.\n\n"
    "Residuals are in mm, simulated less seen: of markers three a marker and time (x, y, z), marker by marker; of\n"
    "pictures one a stripe or outline point. NaN where a marker was not seen, or where the simulation diverged.\n"
    "values: a dict from parameter names (what it lacks is at its usual value), or one number a parameter in the "
    "order\n"
    "of `parameters`. state: of `state()`; by default that of the same values, which is sought anew at each call.\n"
    "drag: nonlinear_drag, linear_drag or no_drag. cells: of the sheet along the width. rate_hz, image_rate_hz: to "
    "which\n"
    "markers and pictures are thinned.";

}  // namespace

VectorXd CampaignSimulation::coordinates(const py::object& values) const {
  VectorXd x = model::usual_coordinates(parameters);
  if (py::isinstance<py::dict>(values)) {
    for (const auto& [key, value] : values.cast<py::dict>()) {
      const size_t k = model::place_of(parameters, key.cast<std::string>());
      if (k == parameters.size()) refuse("values", "found no parameter {}", in_quotes(key.cast<std::string>()));
      x(static_cast<Index>(k)) = to_coordinate(parameters[k], value_of(parameters[k], value));
    }
    return x;
  }
  const py::sequence list = py::reinterpret_borrow<py::sequence>(values);
  if (py::len(list) != parameters.size())
    refuse("values", "found {} numbers, expected {}, one a parameter", py::len(list), parameters.size());
  for (size_t k = 0; k < parameters.size(); ++k)
    x(static_cast<Index>(k)) = to_coordinate(parameters[k], value_of(parameters[k], list[k]));
  return x;
}

py::dict CampaignSimulation::values(const VectorXd& x) const {
  py::dict out;
  for (size_t k = 0; k < parameters.size(); ++k)
    out[py::str(parameters[k].name)] = to_value(parameters[k], x(static_cast<Index>(k)));
  return out;
}

size_t CampaignSimulation::trial(const std::string& name) const {
  for (size_t i = 0; i < simulation->trials().size(); ++i)
    if (simulation->trials()[i].name == name) return i;
  refuse("trial", "found no trial {}", in_quotes(name));
}

void bind_residuals(py::module_& m) {
  bind_parameter(m);
  const py::arg_v at = py::arg("state") = py::none(), told = py::arg("progress") = false;
  py::class_<Self>(m, "Simulation", simulation_doc)
      .def(py::init(&made), py::arg("campaign"), py::kw_only(), py::arg("drag") = "nonlinear_drag",
           py::arg("cells") = 12, py::arg("rate_hz") = 30.0, py::arg("image_rate_hz") = 10.0, told)
      .def_readonly("parameters", &Self::parameters, "A Parameter each.")
      .def_property_readonly(
          "usual", [](const Self& self) { return self.values(usual_coordinates(self.parameters)); },
          "The usual value of each parameter, by name.")
      .def_property_readonly(
          "trials", [](const Self& self) { return py::list(self.by_trial([](size_t i) { return i; })); },
          "Names of the trials.")
      .def_property_readonly("cells", [](const Self& self) { return self.simulation->options().cells; })
      .def(
          "state",
          [](const Self& self, const py::object& values, double nudging_per_s, const py::object& progress) {
    const VectorXd x = self.coordinates(values);
    return long_call({"equilibria", progress, self.stop},
                     [&](LongCall&) { return self.simulation->state_at(self.parameters, x, nudging_per_s); });
          },
          py::arg("values"), py::kw_only(), py::arg("nudging_per_s") = 0.0, told,
          "The State in which each trial hangs on its recorded branch of equilibrium. nudging_per_s: how strongly the\n"
          "sheet is held near its markers, 1/s; 0: it runs free.")
      .def("residuals", &residuals, py::arg("values"), py::kw_only(), at, told, "{trial: (R,) mm}.")
      .def("derivatives", &derivatives, py::arg("values"), py::kw_only(), at, py::arg("step") = 0.05, told,
           "{trial: (R, P) mm}: of residuals with ln(value), by central differences of `step`.")
      .def("rms_mm", &rms, py::arg("values"), py::kw_only(), at, told,
           "{trial: root mean square error, mm}: distance of markers in space, or of stripe and outline points.")
      .def(
          "sd_mm", [](const Self& self) { return self.by_trial([&](size_t i) { return self.simulation->sd_mm(i); }); },
          "{trial: (R,) mm}: a standard deviation for each residual, of sensor and grid.")
      .def(
          "time_s",
          [](const Self& self) { return self.by_trial([&](size_t i) { return self.simulation->time_s(i); }); },
          "{trial: (R,) s}: when each residual was seen.")
      .def("motion", &motion, py::arg("trial"), py::arg("values"), py::kw_only(), at, told,
           "The Motion of one trial, named.");
}

}  // namespace selvedge::python
