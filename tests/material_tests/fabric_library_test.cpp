#include "material_tests/fabric_library.h"

#include <cmath>

#include <gtest/gtest.h>

#include "files/whole_file.h"
#include "tests/refusal.h"
#include "tests/rig/temporary_folder.h"

namespace selvedge::material_tests {
namespace {

namespace fs = std::filesystem;

class FabricLibrary : public testing::Test {
 protected:
  fs::path table(const std::string& text) const {
    files::write_whole(folder_ / "table.csv", text);
    return folder_ / "table.csv";
  }

  const rig::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(FabricLibrary, ReadsTablesOfItsOwnAndOfOthers) {
  const auto own = fabrics_of_table(table("name,areal_mass,bend_warp,bend_weft\ndenim,0.4,9e-5,4e-5\n"));
  ASSERT_EQ(own.size(), 1u);
  EXPECT_EQ(own[0].name, "denim");
  EXPECT_NEAR(bending_length(own[0]), std::cbrt(6e-5 / 9.81 / 0.4), 1e-9);
  const auto others = fabrics_of_table(
      table("density[kg.m-2], linear warp[SI*1e9], linear weft[SI*1e9], linear diag[SI*1e9], nonlinear warp[SI*1e12], "
            "nonlinear weft[SI*1e12]\n0.2, 1779.9, 3076.2, 2244.1, -8478.2, -4158.5\n0.1,1000,1000,1000,-1,-2\n"));
  ASSERT_EQ(others.size(), 2u);
  EXPECT_NEAR(others[0].bend_warp, 1.7799e-6, 1e-15);
  EXPECT_NEAR(others[0].second_order_weft.value(), -4.1585e-9, 1e-18);
  EXPECT_EQ(others[1].name, "table-3");
}

TEST_F(FabricLibrary, RefusesByLineAndColumn) {
  const auto said = [&](const std::string& text) {
    const fs::path file = table(text);
    return refusal_of([&] { fabrics_of_table(file); });
  };
  EXPECT_NE(said("areal_mass,bend_warp\n1,1\n").find("bend_weft"), std::string::npos);
  EXPECT_NE(said("areal_mass,bend_warp,bend_weft\n0.2,1e-5,1e-5\n0.2,x,1e-5\n").find("table.csv:3: column 2"),
            std::string::npos);
  EXPECT_NE(said("areal_mass,bend_warp,bend_weft\n0.2,-1e-5,1e-5\n").find("table.csv:2"), std::string::npos);
  EXPECT_NE(said("areal_mass,bend_warp,bend_weft\n").find("no rows"), std::string::npos);
}

TEST_F(FabricLibrary, KeepsAndFindsFabrics) {
  LibraryFabric denim{"denim", "fit of monday", 0.4, 9e-5, 4e-5, -1e-8, std::nullopt};
  add_to_library(folder_, "denim", {denim});
  const auto library = read_library(folder_);
  ASSERT_EQ(library.size(), 1u);
  EXPECT_EQ(fabric_named(library, "denim", folder_).bend_weft, 4e-5);
  EXPECT_EQ(library[0].second_order_warp, -1e-8);
  EXPECT_FALSE(library[0].second_order_weft);
  EXPECT_NE(refusal_of([&] { add_to_library(folder_, "denim", {denim}); }).find("denim.json"), std::string::npos);
  EXPECT_NE(refusal_of([&] { fabric_named(library, "silk", folder_); }).find("silk"), std::string::npos);
  EXPECT_TRUE(read_library(folder_ / "nowhere").empty());
}

TEST_F(FabricLibrary, TakesTheFabricOfAFit) {
  files::write_whole(folder_ / "fit.json", R"({"format": "fit/1", "campaign": "monday",
    "fabric": {"name": "denim", "areal_mass": 0.4},
    "parameters": {"bend": {"value": 6e-5}, "bend_anisotropy": {"value": 0.4}}})");
  const LibraryFabric f = fabric_of_fit(folder_ / "fit.json");
  EXPECT_EQ(f.name, "denim");
  EXPECT_NEAR(f.bend_warp / f.bend_weft, std::exp(0.8), 1e-9);
  EXPECT_NEAR(mean_bend(f), 6e-5, 1e-12);
}

TEST_F(FabricLibrary, SaysWhereAFabricLies) {
  std::vector<LibraryFabric> library;
  for (int i = 0; i < 100; ++i) {
    const double length = 0.01 + 2e-4 * i;
    const double bend = 9.81 * 0.2 * length * length * length;
    library.push_back({fmt::format("f{}", i), "", 0.2, bend, bend, {}, {}});
  }
  const auto inside = place_among(library, 0.0201, 0.2);
  ASSERT_EQ(inside.size(), 1u);
  EXPECT_NE(inside[0].find("20.1 mm at percentile 51 (15.9 µN·m, 0.16 gf·cm²/cm), areal mass 200 g/m²"),
            std::string::npos)
      << inside[0];
  const auto far = place_among(library, 0.05, 0.2);
  ASSERT_EQ(far.size(), 2u);
  EXPECT_NE(far[1].find("no fabric of the library"), std::string::npos);
  // Without a library of its own: among published percentiles.
  const auto published = place_among({}, 0.0186, 0.197);
  ASSERT_EQ(published.size(), 1u);
  EXPECT_NE(published[0].find("percentile 50"), std::string::npos) << published[0];
  EXPECT_EQ(place_among({}, 0.045, 0.16).size(), 2u);
}

}  // namespace
}  // namespace selvedge::material_tests
