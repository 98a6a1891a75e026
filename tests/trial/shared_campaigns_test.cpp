// Every campaign and recording in ../shared is read, to the last pixel.
#include <gtest/gtest.h>

#include "capture/trial/trial.h"

namespace selvedge::trial {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> campaigns_below(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (fs::exists(entry.path() / "campaign.json")) found.push_back(entry.path());
  return found;
}

TEST(SharedCampaigns, AreAllRead) {
  const fs::path shared = fs::path(SELVEDGE_SOURCE_DIR) / "../shared";
  std::vector<fs::path> folders = campaigns_below(shared / "campaigns");
  for (const fs::path& path : campaigns_below(shared / "real")) folders.push_back(path);
  if (folders.empty()) GTEST_SKIP() << "SKIPPED: no campaigns in " << shared << ", nothing was read";
  for (const fs::path& folder : folders) {
    SCOPED_TRACE(folder);
    const Campaign campaign = read_campaign(folder);
    EXPECT_GE(campaign.trials.size(), 5u);
    for (const Trial& trial : campaign.trials) {
      SCOPED_TRACE(trial.name);
      EXPECT_GT(trial.fabric.mass_kg, 0);
      EXPECT_GE(trial.corners.time_s.size(), 10u);
      ASSERT_TRUE(trial.frames || trial.markers);
      if (!trial.frames) continue;
      // The fabric under stripes is neither black nor one grey.
      const GreyImage image = read_frame(trial, trial.frames->number.size() - 1);
      EXPECT_EQ(image.rows(), trial.camera->height_px);
      EXPECT_GT(image.cast<double>().maxCoeff() - image.cast<double>().minCoeff(), 20);
    }
  }
}

}  // namespace
}  // namespace selvedge::trial
