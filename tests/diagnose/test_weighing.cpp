// Where sets of effects are weighed, of a small campaign simulated by the model itself.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "diagnose/base_fit.h"
#include "diagnose/effect_sets.h"
#include "diagnose/effects/library.h"
#include "diagnose/weighing.h"
#include "tests/diagnose/simulated_campaign.h"

namespace selvedge::diagnose {
namespace {

double apart_mm(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return 1e3 * std::sqrt((a - b).colwise().squaredNorm().mean());
}

std::vector<Effect> named(const std::vector<std::string>& names) {
  std::vector<Effect> out;
  for (const Effect& e : effect_library())
    if (std::find(names.begin(), names.end(), e.name) != names.end()) out.push_back(e);
  return out;
}

// Of a swatch's campaign, on so many cells, from the base that made it.
Study study_of(const SimulatedSwatch& swatch, const std::vector<Effect>& effects, long cells) {
  StudyOptions options;
  options.protocol.cells = cells;
  options.protocol.rate_hz = 20;
  options.base_fit = BaseFit{base_of(swatch, swatch.material.stretch, swatch.material.shear), 0, {}};
  return std::move(make_study(simulated_campaign(swatch), effects, options).study);
}

// A draught blows a soft sheet to another place than it hangs at without. Derivatives with the draught are taken from
// there: from where the base hangs some of their simulations would find other folds than the others do.
TEST(Weighing, BeginsWhereASheetHangsInADraught) {
  SimulatedSwatch windy = usual_fabric();
  windy.material.bend = 2e-5;
  windy.air_m_s = {0.08, 0.3, 0};
  Study study = study_of(windy, named({"draught"}), 8);
  const Windows windows(*study.simulation, study.protocol);
  const Weighing weighing = weigh(study, windows, {});
  ASSERT_TRUE(weighing.there.has_value());
  const model::State& there = weighing.there->branches;
  const size_t still = 0;
  ASSERT_TRUE(study.simulation->trials()[still].still);
  const model::Residuals hangs =
      study.simulation->evaluate(there, study.parameters, weighing.there->x, {still}).front();
  EXPECT_LT(apart_mm(there.branch[still], hangs.start[still]), 0.1);
  EXPECT_GT(apart_mm(study.state.branch[still], hangs.start[still]), 1);
}

// From twice the bending stiffness and half the shear the way leads to those that made the trials, though it is
// found on a coarse grid: two steps along derivatives of where it begins do not reach them.
TEST(Weighing, TheBaseStandsAtTheBottom) {
  const SimulatedSwatch swatch = usual_fabric();
  const Eigen::VectorXd truth = base_of(swatch, swatch.material.stretch, swatch.material.shear);
  const std::vector<model::Parameter> base = model::base_parameters();
  Eigen::VectorXd off = truth;
  off(static_cast<Eigen::Index>(model::place_of(base, "bend"))) += 0.8;
  off(static_cast<Eigen::Index>(model::place_of(base, "shear"))) -= 0.6;
  StudyOptions options;
  options.protocol.cells = 9;
  options.protocol.coarse_cells = 6;
  options.protocol.rate_hz = 20;
  options.base_fit = BaseFit{off, 0, {}};
  Study study = make_study(simulated_campaign(swatch), {}, options).study;
  EXPECT_EQ(study.coarse->options().cells, 6);
  const Windows windows(*study.simulation, study.protocol);
  const Weighing weighing = weigh(study, windows, {});
  for (const char* name : {"bend", "shear"}) {
    const auto at = static_cast<Eigen::Index>(model::place_of(base, name));
    EXPECT_NEAR(weighing.none.x(at), truth(at), 0.15) << name;
  }
}

// The base is moved with the clock, so where a delay is the likeliest there is no other place to look at.
TEST(Weighing, StandsWhereTheClockDoes) {
  SimulatedSwatch late = usual_fabric();
  late.delay_s = 0.012;
  Study study = study_of(late, named({"camera_delay", "creep"}), 6);
  const Windows windows(*study.simulation, study.protocol);
  const Weighing weighing = weigh(study, windows, {});
  ASSERT_EQ(weighing.first.size(), 1u);
  EXPECT_EQ(study.effects[weighing.first[0]].name, "camera_delay");
  EXPECT_FALSE(weighing.there.has_value());
  EXPECT_NEAR(weighing.none.x(static_cast<Eigen::Index>(study.first_parameter[weighing.first[0]])), 0.012 / 0.005, 0.4);
}

// Where all that is found of the fabric must grow alike, it grows: a mass that is not as it was weighed does the same
// to motion, but it was weighed.
TEST(Weighing, LeavesToTheBaseWhatItDoesAlike) {
  Study study = study_of(usual_fabric(), named({"mass_error"}), 6);
  for (const char* name :
       {"stretch", "shear", "bend", "stretch_damping", "shear_damping", "bend_damping", "drag_normal", "drag_tangent"})
    study.base(static_cast<Eigen::Index>(model::place_of(study.parameters, name))) -= 0.25;
  const Windows windows(*study.simulation, study.protocol);
  const Weighing weighing = weigh(study, windows, {});
  EXPECT_FALSE(weighing.none.can_tell[0]);
  EXPECT_LT(std::abs(weighing.none.x(static_cast<Eigen::Index>(study.first_parameter[0]))), 0.3) << "scales";
}

// Derivatives by effects that hardly matter beside a set stay those of where it began; those by the others are of where
// it stands, as if all had been taken there.
TEST(Weighing, TakesDerivativesAgainWhereTheyMatter) {
  const SimulatedSwatch swatch = usual_fabric();
  const std::vector<Effect> some = named({"camera_delay", "added_mass", "mesh_resolution"});
  ASSERT_EQ(some.size(), 3);
  Study study = study_of(swatch, some, 6);
  const Windows windows(*study.simulation, study.protocol);
  const Eigen::MatrixXd forces = responses_to_forces(study, windows);
  const Linearisation before = linearise(study, windows, study.state, study.base, forces);
  Eigen::VectorXd x = study.base;
  x.head(static_cast<Eigen::Index>(study.base_count)).array() += 0.1;
  const Linearisation all = linearise(study, windows, study.state, x, forces);
  for (size_t again = 0; again < some.size(); ++again) {
    const Linearisation there = linearise_again(study, windows, study.state, x, before, {again});
    EXPECT_EQ(there.residual, all.residual);
    ASSERT_EQ(there.changes.cols(), all.changes.cols());
    for (size_t k = 0; k < all.columns.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const Column& c = all.columns[k];
      const bool is_there = c.is_base || c.is_force || c.effect == again || some[c.effect].name == "mesh_resolution";
      const Eigen::VectorXd& expected = (is_there ? all : before).changes.col(at);
      EXPECT_LT((there.changes.col(at) - expected).norm(), 1e-3 * expected.norm()) << "column " << k;
    }
  }
}

// Two parameters that nearly do the same, as shifts of a projector across its rows and along them. Against each other
// they hardly show (here 0.05 mm): that is negligible, however far it is, and makes no effect. What shows is found.
TEST(Weighing, TakesWhatHardlyShowsOfAnEffectAsNegligible) {
  const auto shift = [](const std::string& name, const Eigen::Vector3d& unit_m) {
    return of_motion(effect_parameter(name, "", 0, -40, 40, 1,
                                      [=](model::Prediction& p, double v) { p.sensor.shift_m += v * unit_m; }));
  };
  const Effect effect{
      "moved", Side::measurement, "the camera moved", {shift("across", {0, 0, 1e-3}), shift("along", {4e-5, 0, 5e-4})}};
  Study study = study_of(usual_fabric(), {effect}, 8);
  const Windows windows(*study.simulation, study.protocol);
  const Weighing weighing = weigh(study, windows, {});
  const Linearisation& about = weighing.none;
  ASSERT_TRUE(about.can_tell[0]);
  const auto gain = [&](const Eigen::VectorXd& more) {
    Linearisation seen = about;
    seen.residual += more;
    const std::vector<EffectSet> sets = weigh_sets(study, *weighing.evidence, seen);
    const auto best = [](const EffectSet& set) {
      return *std::max_element(set.log_evidence.begin(), set.log_evidence.end());
    };
    return best(sets[1]) - best(sets[0]);
  };
  const auto change = [&](const Eigen::Vector2d& scales) {
    const std::vector<Eigen::Index>& columns = about.ways[0].columns;
    return Eigen::VectorXd(about.changes(Eigen::all, columns) * scales);
  };
  EXPECT_LT(gain(change({-1, 2})), 1);
  EXPECT_GT(gain(change({2, 0})), 5);
}

}  // namespace
}  // namespace selvedge::diagnose
