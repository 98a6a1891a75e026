// Bending found again from rendered silhouettes of discs that were simulated on a finer sheet.
#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "files/bad_input.h"
#include "material_tests/cusick.h"
#include "material_tests/silhouette.h"

namespace selvedge::material_tests {
namespace {

const CusickOptions quick{.cells = 7, .spokes = 60, .drapes = 2};

trial::Trial disc_trial(const std::string& name, double areal_mass) {
  trial::Trial t;
  t.name = name;
  t.experiment = trial::Experiment::cusick;
  t.fabric = {"wool", 0.3, 0.3, areal_mass * M_PI / 4 * 0.3 * 0.3, true};
  t.cusick = trial::Cusick{0.3, 0.18, {}};
  return t;
}

// Two captures of one disc with these numbers of folds, pictures turned by turn_rad.
trial::Trial rendered(const std::string& name, const cloth::Material& m, const std::vector<int>& folds,
                      double turn_rad) {
  const DiscSheet sheet({}, 9, 84);
  trial::Trial t = disc_trial(name, m.density);
  for (const int n : folds) {
    const Drape drape = come_to_rest(sheet, m, folded(sheet, n), {.change_m = 2e-5});
    EXPECT_TRUE(drape.at_rest);
    EXPECT_EQ(crossings(sheet, drape.control), 0u);
    const Silhouette s = silhouette_of(sheet, drape.control, Eigen::Vector3d(0, 0, 1), 1000);
    t.cusick->outlines.push_back({static_cast<int>(t.cusick->outlines.size()) + 1,
                                  Eigen::Rotation2Dd(turn_rad).toRotationMatrix() * outline_of(s.image, s.scale)});
  }
  return t;
}

cloth::Material hidden(double bend, double anisotropy) {
  cloth::Material m;
  m.density = 0.274;
  m.stretch = quick.stretch;
  m.shear = quick.shear;
  m.bend = bend;
  m.bend_anisotropy = anisotropy;
  return m;
}

TEST(Cusick, FindsTheBendingOfAnIsotropicFabric) {
  const trial::Trial a = rendered("a", hidden(3e-5, 0), {6, 7}, 0.3), b = rendered("b", hidden(3e-5, 0), {7, 6}, 1.1);
  const CusickFit fit = fit_cusick_models({&a, &b}, quick);
  EXPECT_NEAR(std::log(fit.models[0].material.bend / 3e-5), 0, 0.08);
  EXPECT_NE(fit.best().name, "anisotropic");
  const auto held_out = predict_drapes(fit, {&b}, quick);
  ASSERT_EQ(held_out.size(), 2u);
  for (const DrapePair& p : held_out) EXPECT_NEAR(p.fitted.drape_coefficient, p.measured.drape_coefficient, 0.015);
  const Answer answer = answer_of(fit, DiscSheet({}, quick.cells, quick.spokes));
  EXPECT_EQ(named(answer, "bend").value, fit.best().material.bend);
  EXPECT_GE(answer.pictures.size(), 3u);
}

TEST(Cusick, FindsAnisotropyAndWhichWayItLies) {
  const double turn = 0.6;
  const trial::Trial a = rendered("a", hidden(2e-5, 0.5), {6, 7}, turn),
                     b = rendered("b", hidden(2e-5, 0.5), {7, 8}, turn);
  const CusickFit fit = fit_cusick_models({&a, &b}, quick);
  EXPECT_EQ(fit.best().name, "anisotropic");
  EXPECT_NEAR(fit.best().material.bend_anisotropy, 0.5, 0.2);
  EXPECT_NEAR(std::log(fit.best().material.bend / 2e-5), 0, 0.15);
  EXPECT_NEAR(fit.axis_rad, turn, 0.15);
}

TEST(Cusick, RefusesWhatIsNoneOrHasTheWrongScale) {
  trial::Trial other = disc_trial("hung", 0.2);
  other.cusick.reset();
  other.experiment = trial::Experiment::static_hang;
  EXPECT_THROW(fit_cusick({&other}), BadInput);
  trial::Trial small = disc_trial("small", 0.2);
  Eigen::Matrix2Xd circle(2, 90);
  for (Eigen::Index i = 0; i < 90; ++i)
    circle.col(i) = 0.09 * Eigen::Vector2d(std::cos(2 * M_PI * double(i) / 90), std::sin(2 * M_PI * double(i) / 90));
  small.cusick->outlines.push_back({1, circle});
  try {
    fit_cusick({&small});
    FAIL() << "a drape coefficient of 0 was taken";
  } catch (const BadInput& e) {
    EXPECT_NE(std::string(e.what()).find("small"), std::string::npos);
    EXPECT_NE(std::string(e.what()).find("scale"), std::string::npos);
  }
}

}  // namespace
}  // namespace selvedge::material_tests
