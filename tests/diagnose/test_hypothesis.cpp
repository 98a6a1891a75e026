// Hypotheses, what they predict of held-out trials, and the experiment that would tell them apart, on a campaign whose
// markers are late.
#include <gtest/gtest.h>

#include "diagnose/base_fit.h"
#include "diagnose/effects/library.h"
#include "diagnose/held_out.h"
#include "diagnose/next_experiment.h"
#include "tests/diagnose/simulated_campaign.h"

namespace selvedge::diagnose {
namespace {

using Eigen::MatrixXd;

constexpr double kLate_s = 0.012;

class Hypotheses : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    SimulatedSwatch late = usual_fabric();
    late.delay_s = kLate_s;
    std::vector<Effect> two;
    for (const Effect& e : effect_library())
      if (e.name == "camera_delay" || e.name == "mass_error") two.push_back(e);
    StudyOptions options;
    options.protocol.cells = 6;
    options.protocol.rate_hz = 20;
    options.base_fit = BaseFit{base_of(late, late.material.stretch, late.material.shear), 0, {}, {}};
    study_ = std::make_unique<Study>(std::move(make_study(simulated_campaign(late), two, options).study));
    const Hypothesis base = base_hypothesis(*study_);
    const MatrixXd columns = screen(*study_, base, {0, 1});
    all_ = {base, make_hypothesis(*study_, base, {0}, columns), make_hypothesis(*study_, base, {1}, columns)};
    refit(*study_, all_, 3);
  }
  static void TearDownTestSuite() { study_.reset(); }
  static inline std::unique_ptr<Study> study_;
  static inline std::vector<Hypothesis> all_;  // the base, the delay, the mass
};

TEST_F(Hypotheses, ARefitFindsTheDelayAndLeavesLess) {
  ASSERT_EQ(name_of(*study_, all_[0]), "none");
  ASSERT_EQ(name_of(*study_, all_[1]), "camera_delay");
  const auto at = static_cast<Eigen::Index>(study_->first_parameter[0]);
  EXPECT_NEAR(model::to_value(study_->parameters[static_cast<size_t>(at)], all_[1].x(at)), kLate_s, 0.002);
  EXPECT_LT(all_[1].cost, 0.8 * all_[0].cost);
  EXPECT_GT(all_[2].cost, all_[1].cost);
}

TEST_F(Hypotheses, AStepStaysWithinBounds) {
  Hypothesis at_bound = all_[1];
  for (const Eigen::Index k : at_bound.active) {
    const model::Parameter& p = study_->parameters[static_cast<size_t>(k)];
    at_bound.x(k) = model::to_coordinate(p, p.upper);
  }
  const Eigen::VectorXd x = steps_from(*study_, at_bound, {0, 1, 2}, {0}).col(0);
  for (const Eigen::Index k : at_bound.active)
    EXPECT_LE(x(k), at_bound.x(k) + 1e-9) << study_->parameters[static_cast<size_t>(k)].name;
}

TEST_F(Hypotheses, AFreshDerivativePredictsASmallChange) {
  std::vector<Hypothesis> one = {all_[1]};
  relinearise(*study_, one);
  Eigen::VectorXd moved = one[0].x;
  constexpr double kStep = 0.05;
  moved(2) += kStep;  // bend
  const Eigen::VectorXd change = residuals_of(*study_, one, moved).col(0) - residuals_of(*study_, one, one[0].x).col(0);
  EXPECT_LT((change - kStep * one[0].jacobian.col(2)).norm(), 0.5 * change.norm());
}

TEST_F(Hypotheses, HeldOutTrialsArePredictedBetterWithWhatIsThere) {
  const HeldOut held = hold_out(*study_, all_);
  ASSERT_EQ(held.mm.rows(), 3);
  for (Eigen::Index t = 0; t < held.mm.cols(); ++t) {
    if (study_->simulation->trials()[static_cast<size_t>(t)].still) continue;
    EXPECT_LT(held.mm(1, t), held.mm(0, t)) << t;
    EXPECT_LT(held.mm(1, t), held.mm(2, t)) << t;
  }
  // A group is predicted by parameters that were fitted without it, so those of different groups differ.
  for (size_t h = 0; h < all_.size(); ++h)
    EXPECT_GT((held.coordinates[h].col(0) - held.coordinates[h].col(1)).norm(), 1e-6) << h;
}

TEST_F(Hypotheses, TheNextExperimentNamesWhatItWouldTellApart) {
  const NextExperiment next = propose_experiment(
      *study_, all_, {{"none", 0.05}, {"unknown", 0.05}, {"camera_delay", 0.5}, {"mass_error", 0.4}});
  EXPECT_EQ(std::set<std::string>(next.separates.begin(), next.separates.end()),
            (std::set<std::string>{"camera_delay", "mass_error"}));
  EXPECT_FALSE(next.what.empty());
  EXPECT_NE(next.session_toml.find("[session"), std::string::npos);
}

}  // namespace
}  // namespace selvedge::diagnose
