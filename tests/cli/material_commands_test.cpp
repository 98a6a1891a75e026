// Strips as a lab measures them, from its files to a fabric in its library, by the binary.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "cli/verify/proofs/strip_of_nodes.h"
#include "files/whole_file.h"
#include "tests/cli/run_binary.h"

namespace selvedge::cli {
namespace {

namespace fs = std::filesystem;

class MaterialCommands : public testing::Test {
 protected:
  void SetUp() override { fs::create_directory(folder()); }
  fs::path folder() const { return scratch_.path() / "work"; }
  Ran run(const std::string& arguments) { return run_binary(arguments, folder()); }

  void write_strip(const std::string& name, const material_tests::BendingLaw& law, double overhang_m) {
    const Eigen::Matrix2Xd line = every_nth(strip_of_nodes(law, 9.81 * 0.2, overhang_m, 400), 20);
    std::string text = "along_mm,down_mm\n";
    for (Eigen::Index i = 0; i < line.cols(); ++i) text += fmt::format("{},{}\n", 1e3 * line(0, i), 1e3 * line(1, i));
    files::write_whole(folder() / name, text);
  }

  ScratchFolder scratch_;
};

TEST_F(MaterialCommands, FromStripsToTheLibrary) {
  const std::string of = " --as cantilever --fabric denim --areal-mass 0.2 --out lab --angle-deg ";
  for (const auto& [name, bend, overhang, angle] :
       {std::tuple{"a", 2e-5, 0.03, 0}, {"b", 2e-5, 0.035, 0}, {"c", 1e-5, 0.025, 90}, {"d", 1e-5, 0.03, 90}}) {
    write_strip(fmt::format("{}.csv", name), {bend, -2e-8}, overhang);
    const Ran imported = run(fmt::format("import {}.csv{}{}", name, of, angle));
    EXPECT_EQ(imported.exit_status, 0) << imported.err;
  }
  EXPECT_NE(run("check lab").out.find("midline of 21 points"), std::string::npos);
  const Ran fitted = run("fit lab --out lab/fit --library shelf");
  ASSERT_EQ(fitted.exit_status, 0) << fitted.err;
  EXPECT_NE(fitted.out.find("618 fabrics"), std::string::npos) << fitted.out;
  const nlohmann::json fit = files::read_json(folder() / "lab" / "fit" / "fit.json");
  EXPECT_NEAR(fit.at("parameters").at("bend").at("value").get<double>() / std::sqrt(2e-5 * 1e-5), 1, 0.02);
  EXPECT_NEAR(fit.at("parameters").at("bend_anisotropy").at("value").get<double>(), 0.5 * std::log(2), 0.02);
  EXPECT_LT(fit.at("parameters").at("bend_stiffening").at("value").get<double>(), 0);
  EXPECT_NE(files::read_whole(folder() / "lab" / "fit" / "report.html").find("<svg"), std::string::npos);

  const Ran added = run("fabrics --library shelf --add lab/fit");
  EXPECT_EQ(added.exit_status, 0) << added.err;
  EXPECT_NE(added.out.find("denim"), std::string::npos);
  files::write_whole(folder() / "table.csv", "name,areal_mass,bend_warp,bend_weft\nsilk,0.05,1e-6,2e-6\n");
  EXPECT_NE(run("fabrics --library shelf --import table.csv").out.find("silk"), std::string::npos);
}

TEST_F(MaterialCommands, WhatCanBeMendedIsSaid) {
  write_strip("a.csv", {2e-5, 0}, 0.03);
  const Ran without = run("import a.csv --as cantilever --fabric denim --angle-deg 0 --out lab");
  EXPECT_EQ(without.exit_status, 2);
  EXPECT_NE(without.err.find("--areal-mass"), std::string::npos) << without.err;
  EXPECT_FALSE(fs::exists(folder() / "lab"));
  const Ran unnamed = run("import a.csv --as cantilever --angle-deg 0 --areal-mass 0.2 --out lab");
  EXPECT_EQ(unnamed.exit_status, 2);
  EXPECT_NE(unnamed.err.find("--fabric"), std::string::npos) << unnamed.err;
  EXPECT_EQ(run("fabrics --library shelf --add nowhere.json").exit_status, 2);
}

}  // namespace
}  // namespace selvedge::cli
