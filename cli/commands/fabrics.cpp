// ./selvedge fabrics: the library of measured fabrics, listed or added to.
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "cli/command.h"
#include "files/bad_input.h"
#include "material_tests/bending_length.h"
#include "material_tests/fabric_library.h"
#include "report/text_table.h"

namespace selvedge::cli {

namespace {

struct FabricsArguments {
  std::filesystem::path library, add, table;
  std::string name;
  int most = 40;
};

std::string millimetres(double m) { return fmt::format("{:.1f}", 1e3 * m); }

void list(const std::filesystem::path& folder, size_t most) {
  const std::vector<material_tests::LibraryFabric> library = material_tests::read_library(folder);
  if (library.empty()) {
    fmt::print("no fabric in {} yet: --add fit.json or --import TABLE.csv puts some there\n", folder.string());
    return;
  }
  std::vector<std::vector<std::string>> rows;
  for (size_t i = 0; i < std::min(most, library.size()); ++i) {
    const material_tests::LibraryFabric& f = library[i];
    rows.push_back({f.name, fmt::format("{:.0f}", 1e3 * f.areal_mass), fmt::format("{:.3g}", f.bend_warp),
                    fmt::format("{:.3g}", f.bend_weft),
                    fmt::format("{:.2g}, {:.2g}", material_tests::gram_force_cm(f.bend_warp),
                                material_tests::gram_force_cm(f.bend_weft)),
                    millimetres(material_tests::bending_length(f)), f.source});
  }
  fmt::print("{}", report::text_table({"fabric", "g/m²", "bend warp, N·m", "bend weft, N·m", "both, gf·cm²/cm",
                                       "bending length, mm", "source"},
                                      rows));
  if (library.size() > rows.size()) fmt::print("and {} more (--most N)\n", library.size() - rows.size());
}

void run(const FabricsArguments& a) {
  const std::filesystem::path folder = material_tests::library_folder(a.library);
  if (!a.add.empty()) {
    const std::filesystem::path file = std::filesystem::is_directory(a.add) ? a.add / "fit.json" : a.add;
    material_tests::LibraryFabric fabric = material_tests::fabric_of_fit(file);
    if (!a.name.empty()) fabric.name = a.name;
    if (fabric.name.empty() || fabric.name.find('/') != std::string::npos)
      refuse("--name", "found {}, expected a name for the fabric", in_quotes(fabric.name));
    material_tests::add_to_library(folder, fabric.name, {fabric});
  }
  if (!a.table.empty())
    material_tests::add_to_library(folder, a.table.stem().string(), material_tests::fabrics_of_table(a.table));
  list(folder, static_cast<size_t>(a.most));
}

}  // namespace

void add_fabrics(CLI::App& app, int&) {
  auto* command = app.add_subcommand("fabrics", "measured fabrics: a lab's own fits and tables, as starting points");
  auto a = std::make_shared<FabricsArguments>();
  command->add_option("--library", a->library,
                      "its folder; by default selvedge/fabrics below $XDG_DATA_HOME or ~/.local/share");
  command->add_option("--add", a->add, "a fit.json, or its folder, whose fabric joins the library");
  command->add_option("--name", a->name, "of the fabric that --add adds; by default the fit's own");
  command->add_option("--import", a->table, "a CSV of fabrics, docs/formats.md lists its columns");
  command->add_option("--most", a->most, "fabrics listed")->check(CLI::PositiveNumber)->capture_default_str();
  command->callback([a] { run(*a); });
}

}  // namespace selvedge::cli
