// ./selvedge compare A B --out DIR: two fits, diagnoses or sessions side by side.
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "cli/command.h"
#include "cli/output_folder.h"
#include "station/comparison.h"

namespace selvedge::cli {

namespace {

struct CompareArguments {
  std::filesystem::path a, b, out;
};

void run_compare(const CompareArguments& a) {
  expect_folder("--out", a.out);
  const nlohmann::json summary = station::write_comparison(station::read_comparison(a.a, a.b), a.out);
  fmt::print("{}wrote {} and {}\n", station::comparison_text(summary), (a.out / "compare.json").string(),
             (a.out / "report.html").string());
}

}  // namespace

void add_compare(CLI::App& app, int&) {
  auto* command = app.add_subcommand(
      "compare", "two fits, diagnoses or sessions side by side: parameters, held-out errors, gaps, what is left");
  auto a = std::make_shared<CompareArguments>();
  command->add_option("A", a->a, "folder with fit.json, diagnosis.json or session.json")->required();
  command->add_option("B", a->b, "the other one")->required();
  command->add_option("--out", a->out, "folder for compare.json and report.html")->required();
  command->callback([a] { run_compare(*a); });
}

}  // namespace selvedge::cli
