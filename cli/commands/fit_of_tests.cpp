#include "cli/commands/fit_of_tests.h"

#include <chrono>
#include <cmath>

#include <fmt/format.h>

#include "material_tests/bending_length.h"
#include "material_tests/fabric_library.h"
#include "material_tests/fit_tests.h"

namespace selvedge::cli {

namespace {

void print_tests(const std::vector<material_tests::KindAnswer>& answers) {
  for (const material_tests::KindAnswer& of : answers) {
    fmt::print("{}: {} trials\n", of.kind, of.trials.size());
    for (size_t k = 0; k < of.answer.parameters.size(); ++k) {
      const material_tests::Determined& p = of.answer.parameters[k];
      const auto [low, high] = material_tests::interval_of(of.answer, k);
      fmt::print("  {:<36} {:>11.4g} {:<6} {:>11.3g} {:>11.3g}\n", p.name, p.value, p.unit, low, high);
    }
    for (const material_tests::Reported& r : of.answer.reported)
      fmt::print("  {:<36} {:>11.4g} {}\n", r.name, r.value, r.unit);
    for (const material_tests::TestError& e : of.answer.errors)
      fmt::print("  {:<36} {:>11.3g} {} root mean square from what was measured\n", e.trial, e.rms, e.unit);
    for (const std::string& remark : of.answer.remarks) fmt::print("  {}\n", remark);
  }
}

}  // namespace

void add_place(std::vector<std::string>& remarks, double bend, double areal_mass,
               const std::filesystem::path& library_folder) {
  const double length = material_tests::bending_length_m(bend, areal_mass);
  const auto library = material_tests::read_library(material_tests::library_folder(library_folder));
  for (std::string& sentence : material_tests::place_among(library, length, areal_mass))
    remarks.push_back(std::move(sentence));
}

void fit_tests_and_write(const trial::Campaign& campaign, const std::filesystem::path& library_folder,
                         const std::filesystem::path& out) {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<material_tests::KindAnswer> answers = material_tests::fit_tests(campaign);
  std::vector<std::string> remarks;
  if (const auto bend = material_tests::joined(answers, "bend"))
    add_place(remarks, std::exp(bend->coordinate), trial::areal_mass(campaign.trials.front()), library_folder);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  material_tests::write_fit_of_tests(answers, campaign, wall_s, remarks, out);
  print_tests(answers);
  for (const std::string& remark : remarks) fmt::print("{}\n", remark);
  fmt::print("wrote {} and {}\n", (out / "fit.json").string(), (out / "report.html").string());
}

}  // namespace selvedge::cli
