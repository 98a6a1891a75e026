// Where sets of effects are weighed, of a small campaign simulated by the model itself.
#include <cmath>

#include <gtest/gtest.h>

#include "diagnose/base_fit.h"
#include "diagnose/effects/library.h"
#include "diagnose/weighing.h"
#include "tests/diagnose/simulated_campaign.h"

namespace selvedge::diagnose {
namespace {

double apart_mm(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return 1e3 * std::sqrt((a - b).colwise().squaredNorm().mean());
}

// A draught blows a soft sheet to another place than it hangs at without. Derivatives with the draught are taken from
// there: from where the base hangs some of their simulations would find other folds than the others do.
TEST(Weighing, BeginsWhereASheetHangsInADraught) {
  SimulatedSwatch windy = usual_fabric();
  windy.material.bend = 2e-5;
  windy.air_m_s = {0.08, 0.3, 0};
  std::vector<Effect> draught;
  for (const Effect& e : effect_library())
    if (e.name == "draught") draught.push_back(e);
  StudyOptions options;
  options.protocol.cells = 8;
  options.protocol.rate_hz = 20;
  options.base_fit = BaseFit{base_of(windy, windy.material.stretch, windy.material.shear), 0, {}};
  Study study = make_study(simulated_campaign(windy), draught, options).study;
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

}  // namespace
}  // namespace selvedge::diagnose
