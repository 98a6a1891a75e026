#include "files/nearest_name.h"

#include <gtest/gtest.h>

namespace selvedge::files {
namespace {

const std::vector<std::string> commands = {"diagnose", "demo", "fit", "fabrics", "arm", "rig"};

TEST(NearestName, IsReachedByFewChanges) {
  EXPECT_EQ(nearest_name("diagnos", commands), "diagnose");
  EXPECT_EQ(nearest_name("dignaose", commands), "diagnose");
  EXPECT_EQ(nearest_name("DEMO", commands), "demo");
  EXPECT_EQ(nearest_name("fti", commands), "fit");
  EXPECT_EQ(nearest_name("--hold_out", {"--hold-out", "--out"}), "--hold-out");
}

TEST(NearestName, IsNoneWhereNothingIsNear) {
  EXPECT_EQ(nearest_name("weave", commands), "");
  EXPECT_EQ(nearest_name("x", commands), "");
  EXPECT_EQ(nearest_name("", {"a"}), "");
  EXPECT_EQ(nearest_name("fit", {}), "");
}

TEST(NearestName, IsAskedFor) {
  EXPECT_EQ(did_you_mean("fitt", commands), ", did you mean fit?");
  EXPECT_EQ(did_you_mean("weave", commands), "");
}

}  // namespace
}  // namespace selvedge::files
