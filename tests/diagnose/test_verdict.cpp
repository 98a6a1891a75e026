// Probabilities of sets of effects, and what they take of the gap in trials that they were not fitted to.
#include <cmath>

#include <gtest/gtest.h>

#include "diagnose/budget.h"
#include "diagnose/effect_sets.h"
#include "diagnose/group_statistics.h"

namespace selvedge::diagnose {
namespace {

class Judged : public ::testing::Test {
 protected:
  Judged() {
    for (const char* name : {"first", "second", "third"}) study_.effects.push_back({name, Side::elastic, "", {}});
    scales_ = {study_.right_scale, 2 * study_.protocol.unknown_over * study_.right_scale};
  }

  // log_evidence: of none and of each effect alone, where the model error is a right model's.
  Verdict judged(const std::vector<double>& log_evidence, std::map<std::vector<size_t>, GapTaken> taken,
                 double p_of_right = 1) const {
    taken[{}].p_of_right = p_of_right;
    std::vector<EffectSet> sets(log_evidence.size());
    for (size_t k = 0; k < sets.size(); ++k) {
      if (k > 0) sets[k].effects = {k - 1};
      sets[k].log_evidence = {log_evidence[k], -1e3};
    }
    return judge(study_, sets, scales_, taken);
  }

  static double sum(const Verdict& v) {
    double sum = 0;
    for (const auto& [name, p] : v.probability) sum += p;
    return sum;
  }

  Study study_;
  std::vector<double> scales_;
};

TEST_F(Judged, TheLikeliestIsNamed) {
  const Verdict v = judged({0, 8, 4, 0}, {});
  EXPECT_GT(v.probability.at("first"), 0.9);
  EXPECT_NEAR(sum(v), 1, 1e-12);
}

// The likeliest takes nothing of the gap, the second what a right model would.
TEST_F(Judged, ASetThatTakesNothingGivesWayToOneThatTakesTheGap) {
  const GapTaken nothing = {{0.0}, {0.0}, 1e-4}, all = {{1.0}, {1.0}, 0.5};
  const Verdict v = judged({0, 12, 10, 0}, {{{0}, nothing}, {{1}, all}}, 1e-4);
  EXPECT_EQ(v.probability.at("first"), 0);
  EXPECT_EQ(v.inclusion.at("first"), 0);
  EXPECT_GT(v.probability.at("second"), 0.9);
  EXPECT_NEAR(sum(v), 1, 1e-12);
}

// What was not looked at is not taken for an answer, nor is none where held-out trials are against it.
TEST_F(Judged, WhereNothingLookedAtTakesTheGapItIsUnknown) {
  const GapTaken nothing = {{0.0}, {0.0}, 1e-3}, little = {{0.05}, {0.1}, 1e-3};
  const Verdict not_looked_at = judged({-20, 12, 8, 0}, {{{0}, nothing}}, 1e-3);
  EXPECT_GT(not_looked_at.probability.at("unknown"), 0.9);
  EXPECT_NEAR(sum(not_looked_at), 1, 1e-12);
  const Verdict neither = judged({-20, 12, 8, 0}, {{{0}, nothing}, {{1}, little}}, 1e-3);
  EXPECT_GT(neither.probability.at("unknown"), 0.85);
  EXPECT_LT(neither.probability.at("second"), 0.15);
  EXPECT_NEAR(sum(neither), 1, 1e-12);
}

// Evidence that an effect stood in for, where held-out trials are not against none.
TEST_F(Judged, WhereTheLikeliestTakesNothingItIsNone) {
  const Verdict v = judged({0, 7, -3, -3}, {{{0}, {{0.0}, {0.0}, 1}}});
  EXPECT_GT(v.probability.at("none"), 0.9);
  EXPECT_NEAR(sum(v), 1, 1e-12);
}

// It stands beside the one that takes the gap by evidence alone.
TEST_F(Judged, AnEffectThatTakesNothingIsNotNamedBesideOneThatTakesTheGap) {
  EffectSet none, second, both;
  second.effects = {1};
  both.effects = {0, 1};
  none.log_evidence = {-20, -1e3};
  second.log_evidence = {0, -1e3};
  both.log_evidence = {20, -1e3};
  const Verdict v = judge(study_, {none, second, both}, scales_, {{{0, 1}, {{-0.1, 1.0}, {0.0, 1.0}, 1}}});
  EXPECT_EQ(v.inclusion.at("first"), 0);
  EXPECT_GT(v.probability.at("second"), 0.99);
  EXPECT_LT(v.weights[0].all_take, 1e-12);
}

// Windows do not show it.
TEST_F(Judged, WhatARightModelWouldHardlyLeaveIsOfSomethingUnknownBeside) {
  const auto unknown_beside = [&](double p_of_right) {
    const Verdict v = judged({-20, 0, -20, -20}, {{{0}, {{1.0}, {1.0}, p_of_right}}});
    EXPECT_GT(v.inclusion.at("first"), 0.99);
    double sum = 0;
    for (const Weight& w : v.weights) sum += w.and_unknown ? w.probability : 0;
    return sum;
  };
  EXPECT_GT(unknown_beside(1e-3), 0.85);
  EXPECT_LT(unknown_beside(0.5), 1e-6);
  const Verdict none = judged({20, 0, 0, 0}, {{{0}, {{0.0}, {0.0}, 1e-3}}}, 1e-3);
  EXPECT_GT(none.probability.at("unknown"), 0.85);
}

// It takes less than what is unknown beside it does.
TEST_F(Judged, WhatNothingExplainsIsOfWhatIsUnknownBeside) {
  const GapTaken little = {{0.2}, {1.0}, 1e-3, 0.6}, right = {{0.2}, {1.0}, 1, 0.6};
  const Verdict v = judged({-20, 0, -20, -20}, {{{0}, little}}), alone = judged({-20, 0, -20, -20}, {{{0}, right}});
  EXPECT_GT(v.inclusion.at("first"), 0.99);
  EXPECT_NEAR(v.probability.at("unknown"), 0.7, 0.06);
  EXPECT_NEAR(sum(v), 1, 1e-12);
  EXPECT_GT(alone.probability.at("first"), 0.99);
  Budget budget;
  budget.parts.push_back({"first", v.inclusion.at("first"), {0.2, 0.1, 0.3}});
  EXPECT_EQ(cause_of(v.probability, v.inclusion, budget), "unknown");
  EXPECT_EQ(cause_of(alone.probability, alone.inclusion, budget), "first");
}

// A model error of 0.5 is a right model's where these err by as much, and four times that where they err by 0.125.
TEST_F(Judged, WhatIsUnknownBeginsAtTwiceWhatARightModelErrsBy) {
  scales_ = {0.125, 0.5};
  EffectSet none, first;
  first.effects = {0};
  none.log_evidence = first.log_evidence = {-20, 0};
  study_.right_scale = 0.5;
  EXPECT_GT(judge(study_, {none, first}, scales_, {}).probability.at("none"), 0.5);
  study_.right_scale = 0.125;
  EXPECT_GT(judge(study_, {none, first}, scales_, {}).probability.at("unknown"), 0.8);
}

// It says nothing of the effects among each other.
TEST_F(Judged, WhatARightModelWouldHardlyLeaveSpeaksAgainstNone) {
  const Verdict likely = judged({0, 2, 1, 0}, {}, 0.5), hardly = judged({0, 2, 1, 0}, {}, 0.01);
  const auto odds = [](const Verdict& v, const char* a, const char* b) {
    return v.probability.at(a) / v.probability.at(b);
  };
  EXPECT_EQ(likely.probability.at("none"), judged({0, 2, 1, 0}, {}).probability.at("none"));
  EXPECT_NEAR(odds(hardly, "none", "first") / odds(likely, "none", "first"), 0.125, 1e-3);  // −e p ln p
  EXPECT_NEAR(odds(hardly, "second", "first"), odds(likely, "second", "first"), 1e-12);
  EXPECT_NEAR(sum(hardly), 1, 1e-12);
}

// By the table of Student's t: 2.132 for 5 groups at 0.05.
TEST(GroupStatistics, AFigureFarBelowIsHardlyFoundThere) {
  EXPECT_NEAR(p_so_low(0.1, 0.03, 5, 0.1), 0.5, 1e-12);
  EXPECT_NEAR(p_so_low(0.07, 0.03, 5, 0.1), 0.05, 1e-12);
  EXPECT_GT(p_so_low(0.2, 0.03, 5, 0.1), 0.99);
  EXPECT_EQ(p_so_low(-1, std::nan(""), 1, 0.1), 1);
  EXPECT_EQ(p_so_low(-1, 0, 5, 0.1), 1);
}

}  // namespace
}  // namespace selvedge::diagnose
