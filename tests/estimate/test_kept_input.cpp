#include "estimate/kept_input.h"

#include <filesystem>

#include <gtest/gtest.h>
#include <unistd.h>

#include "files/whole_file.h"

namespace selvedge::estimate {
namespace {

namespace fs = std::filesystem;

class Kept : public testing::Test {
 protected:
  Kept() {
    for (const char* name :
         {"trial.json", "corners.csv", "markers.csv", "surface.csv", "frames.csv", "frames/000000.png"})
      put(name);
    campaign_.trials.emplace_back();
    campaign_.trials[0].folder = folder_;
    campaign_.trials[0].name = "waving-1";
  }
  ~Kept() override { fs::remove_all(folder_); }
  void put(const std::string& name, const std::string& more = "") {
    fs::create_directories((folder_ / name).parent_path());
    files::write_whole(folder_ / name, name + more);
  }
  const fs::path folder_ = fs::path(testing::TempDir()) / ("selvedge_kept_input_" + std::to_string(::getpid()));
  trial::Campaign campaign_;
};

TEST_F(Kept, EveryFileOfATrialCountsPicturesToo) {
  const std::string before = recordings_hash(campaign_);
  EXPECT_EQ(recordings_hash(campaign_), before);
  for (const char* name :
       {"trial.json", "corners.csv", "markers.csv", "surface.csv", "frames.csv", "frames/000000.png"}) {
    put(name, "changed");
    EXPECT_NE(recordings_hash(campaign_), before) << name;
    put(name);
  }
  put("frames/000001.png");
  EXPECT_NE(recordings_hash(campaign_), before) << "a picture more";
}

TEST_F(Kept, ResultsBesideATrialDoNotCount) {
  const std::string before = recordings_hash(campaign_);
  put("fit.json");
  put("frames/thumbnails/000000.png");
  EXPECT_EQ(recordings_hash(campaign_), before);
}

TEST_F(Kept, ReplicatesSettingsAndCodeCount) {
  const std::string before = recordings_hash(campaign_);
  EXPECT_NE(input_hash(before, "one"), input_hash(before, "another"));
  EXPECT_EQ(std::string(code_version()).size(), 64u);
  campaign_.replicates = {{"waving-1", "waving-2"}};
  EXPECT_NE(recordings_hash(campaign_), before);
}

}  // namespace
}  // namespace selvedge::estimate
