// Campaigns of one fabric taken together.
#include <gtest/gtest.h>

#include "capture/trial/trial.h"
#include "files/bad_input.h"

namespace selvedge::trial {
namespace {

Campaign campaign(const std::string& folder, const std::string& fabric, const std::vector<std::string>& names) {
  Campaign c;
  c.folder = folder;
  c.fabric = fabric;
  for (const std::string& name : names) {
    c.trials.emplace_back();
    c.trials.back().name = name;
  }
  return c;
}

TEST(JoinedCampaigns, KeepTrialsApartWhoseNamesAreAlike) {
  Campaign first = campaign("monday", "denim", {"waving-1", "robot-1"}),
           second = campaign("next", "denim", {"robot-1", "robot-2"});
  second.replicates = {{"robot-1", "robot-2"}};
  const Campaign all = joined({first, second});
  EXPECT_EQ(all.folder, "monday");
  std::vector<std::string> names;
  for (const Trial& t : all.trials) names.push_back(t.name);
  EXPECT_EQ(names, (std::vector<std::string>{"waving-1", "robot-1", "robot-1 of next", "robot-2"}));
  EXPECT_EQ(all.replicates, (std::vector<std::vector<std::string>>{{"robot-1 of next", "robot-2"}}));
}

TEST(JoinedCampaigns, FoldersOfOneNameAreKeptApartToo) {
  const Campaign all = joined({campaign("a/x", "denim", {"robot-1"}), campaign("b/x", "denim", {"robot-1"}),
                               campaign("c/x", "denim", {"robot-1"})});
  EXPECT_EQ(all.trials[1].name, "robot-1 of x");
  EXPECT_EQ(all.trials[2].name, "robot-1 of x of x");
}

TEST(JoinedCampaigns, AreEachThereOnce) {
  EXPECT_THROW(joined({campaign("a", "denim", {"x"}), campaign("./a", "denim", {"x"})}), BadInput);
}

TEST(JoinedCampaigns, AreOfOneFabric) {
  EXPECT_THROW(joined({campaign("a", "denim", {"x"}), campaign("b", "knit", {"y"})}), BadInput);
}

}  // namespace
}  // namespace selvedge::trial
