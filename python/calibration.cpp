// Fit and diagnosis of a campaign.
#include "diagnose/diagnosis_report.h"
#include "diagnose/effects/library.h"
#include "files/bad_input.h"
#include "fit/fit_campaign.h"
#include "fit/fit_report.h"
#include "python/bindings.h"
#include "python/campaign_simulation.h"
#include "python/long_call.h"
#include "python/sound_trial.h"

namespace selvedge::python {

namespace {

namespace fs = std::filesystem;

// A campaign, or the folder of one. Where something is to be written it must be a folder: what is written names the
// recordings that it rests on.
trial::Campaign campaign_of(const py::object& given, const std::optional<fs::path>& out) {
  if (!py::isinstance<trial::Campaign>(given)) return trial::read_campaign(given.cast<fs::path>());
  if (out) refuse("out", "found a campaign in memory, expected its folder: write_campaign first");
  trial::Campaign campaign = given.cast<trial::Campaign>();
  expect_sound(campaign);
  if (campaign.folder.empty()) campaign.folder = campaign.fabric;
  return campaign;
}

void expect_folder(const std::optional<fs::path>& out) {
  if (out && fs::exists(*out) && !fs::is_directory(*out))
    refuse(out->string(), "found a file, expected a folder or none");
}

// Of its JSON Python makes selvedge.Fit; the arrays come from here.
struct Fitted {
  fit::FitOutcome outcome;
  CampaignSimulation simulation;
};

Fitted fit_campaign(const py::object& given, const std::string& drag, int cells, const std::string& hold_out,
                    int max_iterations, const std::optional<fs::path>& out, const py::object& progress) {
  expect_folder(out);
  if (cells != 0 && (cells < 6 || cells > 64)) refuse("cells", "found {}, expected 6 to 64, or 0", cells);
  if (max_iterations < 1) refuse("max_iterations", "found {}, expected at least 1", max_iterations);
  const trial::Campaign campaign = campaign_of(given, out);
  fit::FitOptions options;
  options.drag = model::drag_named(drag);
  options.cells = cells;
  options.hold_out = fit::hold_out_named(hold_out);
  options.max_iterations = max_iterations;
  const auto stop = std::make_shared<std::atomic<bool>>(false);
  fit::FitOutcome found =
      long_call({"fit " + campaign.folder.filename().string(), progress, stop}, [&](LongCall& call) {
        options.progress = call.progress();
        options.stop = call.stop();
        fit::FitOutcome outcome = fit::fit_campaign(campaign, options);
        if (out) fit::write_fit(outcome, trial::only_tests(campaign, false), *out);
        return outcome;
      });
  std::vector<model::Parameter> parameters;
  for (const fit::FittedParameter& p : found.parameters) parameters.push_back(p.parameter);
  const auto simulation = found.simulation;
  return {std::move(found), {simulation, std::move(parameters), stop}};
}

std::string diagnosis_json(const py::object& given, const Fitted* fitted, const std::vector<std::string>& names,
                           const std::vector<std::string>& without, const std::string& drag, int cells,
                           const std::optional<fs::path>& out, const py::object& progress) {
  expect_folder(out);
  if (cells != 0 && (cells < 6 || cells > 64)) refuse("cells", "found {}, expected 6 to 64, or 0", cells);
  const trial::Campaign campaign = campaign_of(given, out);
  const std::vector<diagnose::Effect> effects = diagnose::chosen_effects(names, without, "effects, without");
  diagnose::DiagnosisOptions options;
  options.study.drag = model::drag_named(drag);
  options.study.protocol.cells = cells;
  if (fitted) {
    if (fitted->simulation.parameters.size() != model::base_parameters(options.study.drag).size())
      refuse("fit", "found one with another drag law, expected {}", drag);
    options.study.fitted = fitted->outcome.coordinates;
  }
  return long_call({"diagnose " + campaign.folder.filename().string(), progress}, [&](LongCall& call) {
    options.study.progress = call.progress();
    options.study.stop = call.stop();
    if (out && !fitted) diagnose::begin_with_fit(options, campaign, {*out, campaign.folder});
    if (out) diagnose::keep_base_fit(options, *out / "base_fit.json", campaign);
    const diagnose::Diagnosis d = diagnose::diagnose(campaign, effects, options);
    if (out) diagnose::write_diagnosis(d, *out);
    return diagnose::to_json(d).dump();
  });
}

void bind_fit(py::module_& m) {
  py::class_<Fitted>(m, "_Fitted")
      .def_property_readonly("json", [](const Fitted& self) { return fit::to_json(self.outcome).dump(); })
      .def_readonly("simulation", &Fitted::simulation)
      .def_property_readonly("state", [](const Fitted& self) { return self.outcome.state; })
      .def_property_readonly("values",
                             [](const Fitted& self) { return self.simulation.values(self.outcome.coordinates); })
      .def_property_readonly("residuals_mm", [](const Fitted& self) {
        return self.simulation.by_trial([&](size_t i) { return self.outcome.residuals.mm[i]; });
      });
  m.def("_fit", &fit_campaign, py::arg("campaign"), py::arg("drag"), py::arg("cells"), py::arg("hold_out"),
        py::arg("max_iterations"), py::arg("out"), py::arg("progress"));
}

}  // namespace

void bind_calibration(py::module_& m) {
  bind_fit(m);
  m.def("_diagnose", &diagnosis_json, py::arg("campaign"), py::arg("fit"), py::arg("effects"), py::arg("without"),
        py::arg("drag"), py::arg("cells"), py::arg("out"), py::arg("progress"));
  m.def(
      "effects",
      [] {
    py::dict out;
    for (const diagnose::Effect& effect : diagnose::effect_library()) out[py::str(effect.name)] = effect.summary;
    return out;
      },
      "The effects that a diagnosis knows: {name: what it is}.");
}

}  // namespace selvedge::python
