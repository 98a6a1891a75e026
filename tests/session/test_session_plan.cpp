#include <gtest/gtest.h>

#include "capture/session/session_plan.h"
#include "tests/refusal.h"

namespace selvedge::session {
namespace {

const std::string kRig =
    "[camera]\naddress = \"127.0.0.1\"\n[fabric]\nname = \"a\"\nwidth_m = 0.3\nheight_m = 0.3\nmass_kg = 0.01\n";

SessionPlan read(const std::string& text) {
  return read_session_plan(rig::Configuration::parse(kRig + text, "rig.toml"));
}

std::string refusal(const std::string& text) {
  return refusal_of([&] { read(text); });
}

TEST(SessionPlan, KeepsTheOrderOfTheTrials) {
  const SessionPlan plan = read(
      "[session]\ntrials = [\"waving-2\", \"static-1\"]\n[session.static-1]\nkind = \"static\"\n"
      "[session.waving-2]\nkind = \"waving\"\nfrequency_hz = 1.3\n");
  ASSERT_EQ(plan.trials.size(), 2u);
  EXPECT_EQ(plan.trials[0].name, "waving-2");
  EXPECT_EQ(plan.trials[0].frequency_hz, 1.3);
  EXPECT_EQ(plan.trials[1].kind, trial::Experiment::static_hang);
}

TEST(SessionPlan, TheExampleOfTheDemoIsWhatItSays) {
  const auto plan = read_session_plan(rig::Configuration::load(SELVEDGE_SOURCE_DIR "/examples/demo-rig.toml"));
  EXPECT_GE(plan.trials.size(), 3u);
  EXPECT_GT(plan.fabric.mass_kg, 0);
}

TEST(SessionPlan, RefusesByName) {
  EXPECT_NE(refusal("[session]\ntrials = [\"a\"]\n").find("\"a\""), std::string::npos);
  EXPECT_NE(refusal("[session]\ntrials = [\"a\"]\n[session.a]\nkind = \"throwing\"\n").find("kind"), std::string::npos);
  EXPECT_NE(refusal("[session]\ntrials = [\"a\"]\n[session.a]\nkind = \"robot\"\n").find("[arm]"), std::string::npos);
  EXPECT_NE(
      refusal("[session]\ntrials = [\"a\"]\n[session.a]\nkind = \"static\"\namplitude_m = 1\n").find("amplitude_m"),
      std::string::npos);
  EXPECT_NE(refusal("[session]\ntrials = [\"../a\"]\n").find("../a"), std::string::npos);
  EXPECT_NE(refusal("[session]\ntrials = [\"a\"]\n[session.a]\nkind = \"waving\"\nduration_s = 1\n").find("duration_s"),
            std::string::npos);
}

}  // namespace
}  // namespace selvedge::session
