// Photographs and tables of draped discs as trials.
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "capture/trial/grey_png.h"
#include "files/bad_input.h"
#include "geometry/polyline.h"
#include "material_tests/silhouette.h"
#include "station/exchange/outline_import.h"
#include "tests/rig/temporary_folder.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;

// Dark star of a support of 60 px and folds that stand out from it.
void write_star(const fs::path& file, int folds, double valley_px) {
  trial::GreyImage image = trial::GreyImage::Constant(256, 256, 250);
  for (int r = 0; r < 256; ++r)
    for (int c = 0; c < 256; ++c) {
      const double x = c - 127.5, y = 127.5 - r, angle = std::atan2(y, x);
      const double radius = valley_px + 20 * std::pow(std::max(0.0, std::cos(folds * angle)), 2);
      if (std::hypot(x, y) < radius) image(r, c) = 5;
    }
  std::ofstream(file, std::ios::binary) << trial::encode_grey_png(image.data(), 256, 256, 6);
}

OutlineImport from(const fs::path& source) {
  OutlineImport o;
  o.source = source;
  o.fabric = "viscose";
  o.areal_mass = 0.2;
  return o;
}

class OutlineImports : public testing::Test {
 protected:
  OutlineImports() {
    write_star(folder_.path() / "sample-1-capture-1.png", 8, 60);
    write_star(folder_.path() / "sample-1-capture-2.png", 9, 60);
    write_star(folder_.path() / "sample-2-capture-1.png", 9, 60.5);
  }
  rig::TemporaryFolder folder_;
};

TEST_F(OutlineImports, SamplesBecomeTrialsAndTheSupportGivesTheScale) {
  const ImportedOutlines found = import_cusick(from(folder_.path()));
  ASSERT_EQ(found.trials.size(), 2u);
  EXPECT_EQ(found.trials[0].name, "sample-1");
  ASSERT_EQ(found.trials[0].cusick->outlines.size(), 2u);
  EXPECT_EQ(found.trials[0].cusick->outlines[1].capture, 2);
  EXPECT_NEAR(trial::areal_mass(found.trials[0]), 0.2, 1e-9);
  EXPECT_NEAR(material_tests::largest_inside(found.trials[0].cusick->outlines[0].point_m).radius_m, 0.09, 5e-4);
  EXPECT_NE(found.scale.find("support's rim"), std::string::npos) << found.scale;
  EXPECT_EQ(found.pictures.size(), 2u);
}

TEST_F(OutlineImports, AScaleThatIsGivenIsTaken) {
  OutlineImport o = from(folder_.path() / "sample-1-capture-1.png");
  o.mm_per_px = 1.2;
  const ImportedOutlines found = import_cusick(o);
  EXPECT_NEAR(found.trials[0].cusick->outlines[0].point_m.colwise().norm().minCoeff(), 0.072, 1e-3);
}

TEST_F(OutlineImports, WhatDoesNotTellIsRefused) {
  write_star(folder_.path() / "sample-2-capture-2.png", 7, 75);  // its valleys hang further out than the support
  try {
    import_cusick(from(folder_.path()));
    FAIL() << "a scale was made up";
  } catch (const BadInput& e) { EXPECT_NE(std::string(e.what()).find("--mm-per-px"), std::string::npos) << e.what(); }
  OutlineImport no_mass = from(folder_.path());
  no_mass.areal_mass.reset();
  no_mass.mm_per_px = 1.2;
  EXPECT_THROW(import_cusick(no_mass), BadInput);
  const fs::path empty = folder_.path() / "empty.png";
  const trial::GreyImage white = trial::GreyImage::Constant(64, 64, 255);
  std::ofstream(empty, std::ios::binary) << trial::encode_grey_png(white.data(), 64, 64, 6);
  OutlineImport blank = from(empty);
  blank.mm_per_px = 1.2;
  EXPECT_THROW(import_cusick(blank), BadInput);
}

TEST_F(OutlineImports, ATableOfALabsOwn) {
  const fs::path file = folder_.path() / "mine.csv";
  std::ofstream csv(file);
  csv << "capture,x_mm,y_mm\n";
  for (int c = 1; c <= 2; ++c)
    for (int i = 0; i < 40; ++i)  // clockwise: is turned round
      csv << c << ',' << 120 * std::cos(-i * M_PI / 20) << ',' << 120 * std::sin(-i * M_PI / 20) << '\n';
  csv.close();
  const ImportedOutlines found = import_cusick(from(file));
  ASSERT_EQ(found.trials[0].cusick->outlines.size(), 2u);
  EXPECT_NEAR(geometry::polygon_area(found.trials[0].cusick->outlines[0].point_m), M_PI * 0.12 * 0.12, 5e-4);
}

}  // namespace
}  // namespace selvedge::station
