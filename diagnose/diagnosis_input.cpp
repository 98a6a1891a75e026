// What a diagnosis may begin with: its own base fit, kept, or the campaign's fit.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "diagnose/diagnosis.h"
#include "estimate/kept_input.h"
#include "fit/fit_campaign.h"
#include "fit/fit_report.h"

namespace selvedge::diagnose {

namespace {

std::string settings_of(const StudyOptions& study) {
  std::string text = std::string(model::to_text(study.drag)) + ' ' + nlohmann::json(study.protocol).dump();
  if (study.fitted)
    for (const double x : *study.fitted) text += fmt::format(" {}", x);
  return text;
}

}  // namespace

std::string input_of(const DiagnosisOptions& options, const trial::Campaign& campaign) {
  return estimate::input_hash(estimate::recordings_hash(campaign), settings_of(options.study));
}

void keep_base_fit(DiagnosisOptions& options, const std::filesystem::path& file, const trial::Campaign& campaign) {
  options.input = input_of(options, campaign);
  options.study.base_fit = read_base_fit(file, options.input);
  options.on_base_fit = [file, input = options.input](const BaseFit& fit) { write_base_fit(file, fit, input); };
}

std::optional<std::filesystem::path> begin_with_fit(DiagnosisOptions& options, const trial::Campaign& campaign,
                                                    const std::vector<std::filesystem::path>& folders) {
  for (const std::filesystem::path& folder : folders) {
    const std::filesystem::path file = folder / "fit.json";
    if (!std::filesystem::exists(file)) continue;
    options.study.fitted = fit::read_fit(file, fit::input_of(estimate::recordings_hash(campaign), options.study.drag),
                                         model::base_parameters(options.study.drag));
    if (options.study.fitted) return file;
  }
  return {};
}

}  // namespace selvedge::diagnose
