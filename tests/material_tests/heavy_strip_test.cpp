#include "material_tests/heavy_strip.h"

#include <gtest/gtest.h>

namespace selvedge::material_tests {
namespace {

TEST(HeavyStrip, AShortOneSagsAsABeam) {
  const BendingLaw law{1e-5, 0};
  const double weight = 1.5, overhang = 0.003;
  const auto strip = hanging_strip(law, weight, overhang);
  ASSERT_TRUE(strip);
  const double sag = weight * std::pow(overhang, 4) / (8 * law.bend);
  EXPECT_NEAR(strip->point_m(1, strip->point_m.cols() - 1) / sag, 1, 1e-4);
  EXPECT_NEAR(strip->edge_curvature, weight * overhang * overhang / (2 * law.bend), 1e-4 * strip->edge_curvature);
}

TEST(HeavyStrip, StepsHardlyMatter) {
  const BendingLaw law{1e-5, -3e-8};
  const auto coarse = hanging_strip(law, 1.5, 0.03, 60), fine = hanging_strip(law, 1.5, 0.03, 600);
  ASSERT_TRUE(coarse && fine);
  EXPECT_LT((coarse->point_m.col(60) - fine->point_m.col(600)).norm(), 1e-8);
  double length = 0;
  for (int i = 0; i < 600; ++i) length += (fine->point_m.col(i + 1) - fine->point_m.col(i)).norm();
  EXPECT_NEAR(length, 0.03, 1e-6);
}

// Bickley 1934, Peirce 1930: at 41.5° half the overhang is the bending length.
TEST(HeavyStrip, TheInstrumentsBendingLengthIsThatOfPeirce) {
  const BendingLaw law{1.4e-5, 0};
  EXPECT_NEAR(instrument_bending_length(law, 1.9).value() / bending_length(law, 1.9), 1, 0.02);
}

TEST(HeavyStrip, ASofterOneHangsLowerAndFoldsAtLast) {
  const double weight = 1.5, c = std::cbrt(1e-5 / weight);
  const auto depth = [&](double second) {
    const auto strip = hanging_strip({1e-5, second}, weight, 1.2 * c);
    return strip ? strip->point_m(1, strip->point_m.cols() - 1) : -1;
  };
  EXPECT_GT(depth(-0.3e-5 * c), depth(0) * 1.02);
  EXPECT_LT(depth(0.3e-5 * c), depth(0) * 0.98);
  EXPECT_EQ(depth(-0.9e-5 * c), -1);
}

TEST(HeavyStrip, SofteningAgreesWithTheSheetsWhereTheRadiusIsTheBendingLength) {
  const BendingLaw law{1e-5, -2e-8};
  const double curvature = 1 / bending_length(law, 1.5);
  EXPECT_NEAR(1 + bend_stiffening(law, 1.5) * curvature * curvature, 1 + law.second_order / law.bend * curvature,
              1e-12);
}

}  // namespace
}  // namespace selvedge::material_tests
