// A fitted fabric as parameters of other simulators: the energies that those simulators publish, of a bent, a stretched
// and a sheared grid, with what the file says, are those of our sheet; what a file cannot say is named in it.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>

#include <Eigen/Dense>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "files/whole_file.h"
#include "station/exchange/material_export.h"
#include "tests/refusal.h"

namespace selvedge::station {
namespace {

using Eigen::Vector3d;

FittedFabric a_knit() {
  return {"knit",
          "fit of a campaign",
          0.187,
          {{"stretch", 80},
           {"shear", 25},
           {"bend", 6e-6},
           {"stretch_damping", 0.02},
           {"shear_damping", 0.01},
           {"bend_damping", 3e-8},
           {"drag_normal", 0.9},
           {"drag_tangent", 0.04},
           {"drag_fade", 0.3}}};
}

double number_after(const std::string& text, const std::string& key) {
  const size_t at = text.find(key);
  EXPECT_NE(at, std::string::npos) << key << "\n" << text;
  return at == std::string::npos ? 0 : std::stod(text.substr(at + key.size()));
}

// A hinge of a square grid of right triangles whose rows are bent by κ: two legs share a side of length h.
constexpr double kSpacing = 0.01, kCurvature = 5;
struct Hinge {
  Vector3d a{0, 0, 0}, b{0, kSpacing, 0}, left, right;  // the side, and the corners across it
  double area = kSpacing * kSpacing, length = kSpacing, angle = kCurvature * kSpacing;
  Hinge() {
    const double half = angle / 2;
    left = Vector3d(-kSpacing * std::cos(half), 0, -kSpacing * std::sin(half));
    right = Vector3d(kSpacing * std::cos(half), kSpacing, -kSpacing * std::sin(half));
  }
  // Σ cot x of Wardetzky et al.: a right angle at one end of the side in each triangle.
  double laplacian() const { return (a + b - left - right).norm(); }
};
// Of our sheet, of the area of a cell.
double own_bending() { return 0.5 * a_knit().value.at("bend") * kCurvature * kCurvature * kSpacing * kSpacing; }

TEST(MaterialExport, ArcsimHasTheEnergiesOfItsSource) {
  const auto file = nlohmann::json::parse(material_text(a_knit(), MaterialFormat::arcsim));
  EXPECT_DOUBLE_EQ(file["density"], 0.187);
  ASSERT_EQ(file["stretching"].size(), 6u);
  const std::vector<double> half = file["stretching"][3];  // evaluate_stretching_sample doubles them
  const auto energy = [&](double g00, double g01, double g11) {
    return 0.5 * 2 * (half[0] * g00 * g00 + half[2] * g11 * g11 + 2 * half[1] * g00 * g11 + half[3] * g01 * g01);
  };
  const double strain = 1e-4;
  EXPECT_NEAR(energy(strain, 0, 0), 0.5 * 80 * strain * strain, 1e-3 * strain * strain);
  EXPECT_NEAR(energy(0, strain / 2, 0), 0.5 * 25 * strain * strain, 1e-3 * strain * strain);  // w_u·w_v = 2 G01
  const Hinge hinge;
  ASSERT_EQ(file["bending"].size(), 3u);
  const double ke = file["bending"][1][4];
  const double bending = ke * hinge.length * hinge.length / (2 * hinge.area) * hinge.angle * hinge.angle / 4;
  EXPECT_NEAR(bending, own_bending(), 1e-3 * own_bending());
  EXPECT_DOUBLE_EQ(file["scene"]["wind"]["density"], 0.9);
  EXPECT_DOUBLE_EQ(file["scene"]["wind"]["drag"], 0.04);
  EXPECT_NEAR(double(file["scene"]["materials"][0]["damping"]), 0.005, 1e-12);
  EXPECT_NE(file["told_by_selvedge"].dump().find("cannot say: drag_fade 0.3"), std::string::npos);
}

TEST(MaterialExport, DiffclothHasTheEnergiesOfItsSource) {
  const std::string text = material_text(a_knit(), MaterialFormat::diffcloth);
  const double k = number_after(text, ".k_stiff_stretching ="), kb = number_after(text, ".k_stiff_bending =");
  EXPECT_DOUBLE_EQ(number_after(text, ".density ="), 0.187);
  // ½ k |F − R|², stretched by ε along u: |F − R| = ε.
  EXPECT_DOUBLE_EQ(k, 80);
  const Hinge hinge;
  const double bending = 0.5 * kb * 3 / hinge.area * std::pow(hinge.laplacian(), 2);
  EXPECT_NEAR(bending, own_bending(), 1e-3 * own_bending());
  for (const char* unsaid : {"shear 25 N/m", "drag_normal 0.9", "bend_damping 3e-08"})
    EXPECT_NE(text.find(unsaid), std::string::npos) << unsaid << "\n" << text;
}

TEST(MaterialExport, MujocoHasTheEnergiesOfItsSource) {
  const std::string text = material_text(a_knit(), MaterialFormat::mujoco, {.spacing_m = kSpacing});
  const double young = number_after(text, "young=\""), thickness = number_after(text, " thickness=\"");
  EXPECT_NEAR(young * thickness, 80, 1e-6);
  const Hinge hinge;
  const double mu = young / 2;
  const double bending = 0.5 * 1.5 / hinge.area * mu * std::pow(thickness, 3) / 12 * std::pow(hinge.laplacian(), 2);
  EXPECT_NEAR(bending, own_bending(), 1e-3 * own_bending());
  EXPECT_NEAR(number_after(text, "mass=\""), 0.187 * 0.3 * 0.3, 1e-9);
  EXPECT_NEAR(number_after(text, "damping=\""), 0.005, 1e-12);
  EXPECT_NE(text.find("drag_normal 0.9"), std::string::npos) << text;
  EXPECT_EQ(text.find("-- "), std::string::npos) << "no XML comment may hold it";
}

TEST(MaterialExport, BlenderHasTheForcesOfItsSource) {
  const std::string text = material_text(a_knit(), MaterialFormat::blender, {.spacing_m = kSpacing});
  const double frame2 = 1e-3, strain = 1e-4;
  const double side = number_after(text, "tension_stiffness = ") / kSpacing, h2 = kSpacing * kSpacing,
               diagonal = number_after(text, "shear_stiffness = ") / kSpacing;
  // A cell has a side in each direction and two diagonals; stretched by ε along u, each diagonal by ε/2.
  const double stretched = 0.5 * side * h2 * strain * strain + 2 * 0.5 * diagonal * 2 * h2 * strain * strain / 4;
  EXPECT_NEAR(stretched / frame2, 0.5 * 80 * strain * strain * h2, 1e-3 * strain * strain * h2);
  const double sheared = 2 * 0.5 * diagonal * 2 * h2 * strain * strain / 4;
  EXPECT_NEAR(sheared / frame2, 0.5 * 25 * strain * strain * h2, 1e-3 * strain * strain * h2);
  // A hinge: k θ in all on the four corners of each quad, of which two lie at the lever h.
  const double k = 0.1 * number_after(text, "bending_stiffness = ") * kSpacing, angle = kCurvature * kSpacing;
  const double moment = 2 * (k * angle / 4) * kSpacing;
  EXPECT_NEAR(moment / frame2, 6e-6 * kCurvature * kSpacing, 1e-9);
  EXPECT_NEAR(number_after(text, "cloth.mass = "), 0.187 * h2, 1e-12);
}

// One mass on one link that is put right as btSoftBody does: it comes to rest where a spring of k would.
TEST(MaterialExport, BulletsLinkHangsAsFarAsASpring) {
  const MaterialMesh mesh{.spacing_m = kSpacing, .step_s = 1.0 / 240, .iterations = 4};
  const std::string text = material_text(a_knit(), MaterialFormat::bullet, mesh);
  const double share = number_after(text, "sides->m_kLST = "), mass = 0.187 * kSpacing * kSpacing, g = 9.81;
  // Two nodes pulled apart by m g each: the link sees both.
  double apart = 0, velocity = 0;
  for (int step = 0; step < 20000; ++step) {
    velocity += 2 * g * mesh.step_s;
    double predicted = apart + velocity * mesh.step_s;
    for (int i = 0; i < mesh.iterations; ++i) predicted -= share * predicted;
    velocity = (predicted - apart) / mesh.step_s;
    apart = predicted;
  }
  EXPECT_NEAR(apart, mass * g / (80 - 25), 0.02 * apart);
  EXPECT_NEAR(number_after(text, "m_cfg.kDG = ") * 0.5 * number_after(text, "->air_density = "), 0.9, 1e-6);
  EXPECT_NE(text.find("cannot say: bend 6e-06"), std::string::npos) << text;
}

// Without sides every other node of a grid hangs on nothing.
TEST(MaterialExport, SidesStayWhereShearIsStifferThanStretch) {
  FittedFabric fabric = a_knit();
  fabric.value["shear"] = 100;
  const std::string blender = material_text(fabric, MaterialFormat::blender, {.spacing_m = kSpacing});
  EXPECT_NEAR(number_after(blender, "tension_stiffness = "), 1e-3 * 40 * kSpacing, 1e-9);
  EXPECT_NEAR(number_after(blender, "shear_stiffness = "), 1e-3 * 40 * kSpacing, 1e-9);
  const std::string bullet = material_text(fabric, MaterialFormat::bullet, {.spacing_m = kSpacing});
  EXPECT_GT(number_after(bullet, "sides->m_kLST = "), 0);
  EXPECT_EQ(number_after(bullet, "sides->m_kLST = "), number_after(bullet, "diagonals->m_kLST = "));
  for (const std::string& text : {blender, bullet})
    EXPECT_NE(text.find("shear is 100 N/m, of which it is told 40"), std::string::npos) << text;
}

TEST(MaterialExport, NothingIsDroppedSilently) {
  for (size_t format = 0; format < material_format_names().size(); ++format) {
    SCOPED_TRACE(material_format_names()[format]);
    FittedFabric fabric = a_knit();
    fabric.value["drag_linear"] = 0.123;
    const std::string text = material_text(fabric, static_cast<MaterialFormat>(format));
    EXPECT_NE(text.find("drag_linear 0.123"), std::string::npos) << text;
    EXPECT_NE(text.find("fit of a campaign"), std::string::npos);
  }
}

TEST(MaterialExport, TakesAFitOfOurOwnSheetAlone) {
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / ("selvedge_material_" + std::to_string(getpid()) + ".json");
  nlohmann::json fit = {{"format", "fit/1"}, {"campaign", "c"}, {"fabric", {{"name", "f"}, {"areal_mass", 0.2}}}};
  for (const auto& [name, value] : a_knit().value) fit["parameters"][name] = {{"value", value}};
  files::write_json(file, fit);
  EXPECT_EQ(fitted_fabric(file).value, a_knit().value);
  fit["simulator"] = {{"name", "mine"}};
  files::write_json(file, fit);
  EXPECT_NE(refusal_of([&] { fitted_fabric(file); }).find("found a fit of mine"), std::string::npos);
  fit.erase("simulator");
  fit["parameters"].erase("shear");
  files::write_json(file, fit);
  EXPECT_NE(refusal_of([&] { fitted_fabric(file); }).find("shear: found nothing"), std::string::npos);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace selvedge::station
