// What `prove exports` compares: our own sheet lies on itself, a stiffer one does not, and the numbers that a worked
// example is given are those of the exported text.
#include <gtest/gtest.h>

#include "cli/verify/proofs/exported_fabric.h"
#include "cli/verify/proofs/proof_fabric.h"
#include "cli/verify/proofs/simulator_behind.h"

namespace selvedge::cli {
namespace {

// Our sheet with another rigidity.
class StifferSheet : public OwnSheetHere {
 public:
  std::vector<cloth::Trajectory> simulate(const cloth::spline::SplineSheet& sheet,
                                          const std::vector<cloth::Experiment>& told) const override {
    std::vector<cloth::Experiment> lanes = told;
    for (cloth::Experiment& lane : lanes) lane.material.bend *= 3;
    return OwnSheetHere::simulate(sheet, lanes);
  }
};

TEST(ExportedFabric, OurOwnSheetLiesOnItselfAndAStifferOneDoesNot) {
  const cloth::Material fabric = proof_fabric();
  const cloth::Experiment motion = hung_and_waved(fabric, 0.25);
  const cloth::spline::SplineSheet sheet = hung_sheet(fabric);
  const HungApart same = apart_of(OwnSheetHere(), sheet, motion, {}),
                  other = apart_of(StifferSheet(), sheet, motion, {});
  EXPECT_LT(same.rest_mm, 0.1);
  EXPECT_LT(same.motion_mm, 0.1);
  EXPECT_GT(other.rest_mm, 1);
  EXPECT_GT(other.motion_mm, 1);
}

TEST(ExportedFabric, TheExamplesAreGivenTheNumbersOfTheText) {
  const cloth::Material fabric = proof_fabric();
  const station::FittedFabric fitted = fitted_as("knit", fabric);
  const station::MaterialMesh mesh{.spacing_m = 0.02};
  const std::string blender = station::material_text(fitted, station::MaterialFormat::blender, mesh),
                    bullet = station::material_text(fitted, station::MaterialFormat::bullet, mesh);
  EXPECT_NEAR(blender_values(blender).at("shear_stiffness"), 1e-3 * 0.02 * fabric.shear, 1e-9);
  EXPECT_NEAR(blender_values(blender).at("bending_stiffness"), 0.02 * fabric.bend / (0.02 * 0.02), 1e-9);
  EXPECT_EQ(blender_values(blender).at("air_damping"), 0);
  EXPECT_NEAR(bullet_values(bullet).at("drag"), 2 * fabric.drag_normal / 1.2, 1e-6);
  EXPECT_GT(bullet_values(bullet).at("sides"), 0);
  EXPECT_NE(unsaid_in(bullet).find("bend "), std::string::npos) << unsaid_in(bullet);
  EXPECT_EQ(unsaid_in(blender).find("bend "), std::string::npos) << unsaid_in(blender);
}

}  // namespace
}  // namespace selvedge::cli
