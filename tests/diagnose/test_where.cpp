// Where the residual lies, of images: carried back onto the fabric.
#include <filesystem>

#include <gtest/gtest.h>

#include "diagnose/base_fit.h"
#include "diagnose/where.h"

namespace selvedge::diagnose {
namespace {

TEST(Where, ImagesAreCarriedBackOntoTheFabric) {
  const std::filesystem::path folder = SELVEDGE_SOURCE_DIR "/../shared/campaigns/striped-none";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "SKIPPED: " << folder << " is absent, no image was compared";
  trial::Campaign campaign = trial::read_campaign(folder);
  std::erase_if(campaign.trials, [](const trial::Trial& t) { return t.name != "static-1"; });
  campaign.replicates.clear();
  ASSERT_EQ(campaign.trials.size(), 1u);
  StudyOptions options;
  options.protocol.cells = 6;
  const auto base = model::base_parameters();
  options.base_fit = BaseFit{model::usual_coordinates(base), 0, {}};
  const Study study = std::move(make_study(campaign, {}, options).study);
  const model::Residuals r = study.simulation->evaluate(study.state, base, study.base.head(study.base_count)).front();
  const Where where = split_residual(study, spots_seen(study), r.mm, 0.3);
  double share = 0;
  int regions = 0;
  for (const Cell& c : where.cells)
    if (c.axis == "region") {
      share += c.share;
      ++regions;
    }
  EXPECT_GE(regions, 6);  // of nine; folds may hide some
  EXPECT_NEAR(share, 1, 1e-9);
  EXPECT_GE(where.map.uv.size(), 20u);
  for (const Eigen::Vector2d& uv : where.map.uv) {
    EXPECT_GT(uv.minCoeff(), 0);
    EXPECT_LT(uv.x(), where.map.width_m);
    EXPECT_LT(uv.y(), where.map.height_m);
  }
}

}  // namespace
}  // namespace selvedge::diagnose
