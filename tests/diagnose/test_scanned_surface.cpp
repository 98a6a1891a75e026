// The diagnosis of a campaign that a depth camera scanned.
#include <gtest/gtest.h>

#include "cli/verify/proofs/scanned_trial.h"
#include "diagnose/diagnosis.h"
#include "diagnose/effects/library.h"
#include "tests/diagnose/simulated_campaign.h"

namespace selvedge::diagnose {
namespace {

trial::Campaign scanned_campaign(double delay_s) {
  const DepthCamera camera{.delay_s = delay_s, .px_apart_m = 5e-3};
  return campaign_of([&](const SimulatedMotion& motion, const std::string& name, unsigned seed) {
    return scanned_trial(usual_fabric(), motion, camera, name, seed);
  });
}

Diagnosis diagnosed_scan(const trial::Campaign& campaign) {
  std::vector<Effect> few;
  for (const Effect& e : effect_library())
    for (const char* name : {"camera_delay", "pose_error", "depth_bias", "draught", "projector_moved", "smoothing"})
      if (e.name == name) few.push_back(e);
  DiagnosisOptions options;
  options.study.protocol.cells = 8;
  return diagnose(campaign, few, options);
}

TEST(ScannedSurface, ItsDelayIsNamedAndItsNullCampaignIsNot) {
  const Diagnosis late = diagnosed_scan(scanned_campaign(0.02));
  EXPECT_EQ(late.cause, "camera_delay");
  EXPECT_NEAR(late.base_fit.clock.at("delay"), 0.02 / 0.005, 1.2) << "in its scale, before effects are weighed";
  EXPECT_EQ(late.inclusion.count("projector_moved"), 0u) << "there is no projector";
  EXPECT_EQ(late.inclusion.count("smoothing"), 0u) << "there is no tracker's filter";
  EXPECT_EQ(late.inclusion.count("depth_bias"), 1u);
  for (const EffectFinding& f : late.effects) {
    if (f.name != "camera_delay") continue;
    EXPECT_NEAR(f.size.at(0).value, 0.02, 0.006);
  }
  ASSERT_FALSE(late.replay.empty());
  for (const report::Points& seen : late.replay.front().seen) EXPECT_GT(seen.size(), 3u * 50) << "is shown in motion";
  const Diagnosis null_campaign = diagnosed_scan(scanned_campaign(0));
  EXPECT_EQ(null_campaign.cause, "none");
  EXPECT_GT(null_campaign.probability.at("none"), 0.8);
  EXPECT_NEAR(null_campaign.sets.at(0).model_error, 1, 0.5) << "as right models usually are";
}

}  // namespace
}  // namespace selvedge::diagnose
