// All material tests of a campaign: fitted kind by kind, and written as fit.json and report.html.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/trial/trial.h"
#include "material_tests/answer.h"

namespace selvedge::report {
class HtmlReport;
}

namespace selvedge::material_tests {

struct KindAnswer {
  std::string kind;                 // "cantilever", "cusick", "tensile"
  std::vector<std::string> trials;  // their names
  Answer answer;
};

// tests: a campaign of material tests alone. Throws BadInput as the fits of the kinds do.
std::vector<KindAnswer> fit_tests(const trial::Campaign& tests);

// What all kinds together say of a parameter: its coordinate (ln of the value, or the value) and deviation; where
// several kinds determine it, weighted by what each knows. Nothing where none does.
struct Joined {
  double coordinate = 0, sd = 0;
  bool logarithmic = true;
  std::string unit, kinds;  // "cantilever and tensile"
};
std::optional<Joined> joined(const std::vector<KindAnswer>& answers, const std::string& parameter);

// For fit.json, key `material_tests`: by kind its trials, parameters, what is reported, errors, remarks.
nlohmann::json to_json(const std::vector<KindAnswer>& answers);

void add_to_report(report::HtmlReport& html, const std::vector<KindAnswer>& answers);

// fit.json (as docs/formats.md has it, with `material_tests`) and report.html of a campaign of tests alone. remarks: to
// be added to those of the tests.
void write_fit_of_tests(const std::vector<KindAnswer>& answers, const trial::Campaign& tests, double wall_s,
                        const std::vector<std::string>& remarks, const std::filesystem::path& folder);

}  // namespace selvedge::material_tests
