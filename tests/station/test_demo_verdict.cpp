// What a demo's run is told to have found, from files as its steps write them.
#include "station/demo_verdict.h"

#include <filesystem>

#include <gtest/gtest.h>
#include <unistd.h>

#include "files/whole_file.h"
#include "station/confirmation.h"

namespace selvedge::station {
namespace {

using nlohmann::json;

json fitted(double value, bool determined) {
  return {{"value", value}, {"unit", "N/m"}, {"interval", {0.9 * value, 1.1 * value}}, {"determined", determined}};
}

// Of two determined parameters the fit has one 40 % off, which the draught mends.
DemoAnswers answers() {
  return {{{"parameters", {{"bend", fitted(1.4, true)}, {"shear", fitted(55, true)}, {"stretch", fitted(300, false)}}},
           {"trials",
            {{"static-1", {{"frames", 20}}},
             {"waving-1", {{"frames", 30}, {"error_moving", 1.0}, {"error_held_out", 1.2}}}}}},
          {{"cause", "draught"},
           {"probabilities", {{"draught", 0.98}, {"none", 0.01}, {"unknown", 0.01}}},
           {"gap", {{"value_mm", 2.5}}},
           {"budget", {{"parts", {{{"effects", {"draught"}}, {"share", 0.83}}}}}},
           {"effect_size", {{"draught", {{"air_y", {{"value", 0.22}, {"unit", "m/s"}, {"interval", {0.17, 0.27}}}}}}}},
           {"parameters", {{"bend", {{"corrected", 1.05}}}, {"shear", {{"corrected", 54}}}}}},
          {{"outcome", "confirmed"}, {"verdict", {{"sentence", "It is confirmed."}}}},
          {{"parameters", {{"bend", {{"value", 1.0}}}, {"shear", {{"value", 55}}}, {"stretch", {{"value", 110}}}}},
           {"hidden", json::array({{{"effect", "draught"}, {"size", {{"air_x", 0.0}, {"air_y", 0.24}}}}})}}};
}

TEST(DemoVerdictTest, ComparesWithTheNamedEffectAdded) {
  const DemoVerdict v = judge(answers());
  EXPECT_TRUE(v.holds()) << to_text(v);
  EXPECT_EQ(v.determined(), 2u);
  EXPECT_NEAR(v.held_out_mm, 1.2, 1e-12);
  for (const char* said : {"draught", "0.22 m/s", "83 % of the gap", "probability 0.98", "It is confirmed.",
                           "The diagnosis is right", "compared with draught added", "air_y 0.24"})
    EXPECT_NE(to_text(v).find(said), std::string::npos) << said << "\n" << to_text(v);
  DemoAnswers without = answers();
  without.diagnosis["parameters"]["bend"]["corrected"] = 1.2;
  EXPECT_FALSE(judge(without).parameters_hold());
}

TEST(DemoVerdictTest, SaysThatTheWrongEffectIsNamed) {
  DemoAnswers wrong = answers();
  wrong.truth["hidden"][0]["effect"] = "camera_delay";
  EXPECT_FALSE(judge(wrong).holds());
  EXPECT_NE(to_text(judge(wrong)).find("The diagnosis is WRONG"), std::string::npos);
  wrong.truth.erase("hidden");
  EXPECT_FALSE(judge(wrong).holds());
  EXPECT_EQ(judge(wrong).hidden, "nothing");
}

TEST(DemoVerdictTest, ASecondSessionThatIsPredictedNoBetterDoesNotHold) {
  DemoAnswers refuted = answers();
  refuted.confirmation["outcome"] = "refuted";
  EXPECT_FALSE(judge(refuted).diagnosis_holds());
  refuted.confirmation = json();
  EXPECT_FALSE(judge(refuted).diagnosis_holds());
}

TEST(DemoVerdictTest, NothingHiddenAndNothingNamedIsRightByTheFitAlone) {
  DemoAnswers none = answers();
  none.truth.erase("hidden");
  none.diagnosis["cause"] = "none";
  none.confirmation = json();
  EXPECT_TRUE(judge(none).diagnosis_holds());
  EXPECT_FALSE(judge(none).parameters_hold());  // the fit's own values: 40 % off
  EXPECT_NE(to_text(judge(none)).find("nothing is missing"), std::string::npos);
}

class SecondSessionTest : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::optional<session::SessionPlan> plan_after(const json& diagnosis) {
    session::SessionPlan recorded;
    recorded.trials.resize(2);
    recorded.trials[0].name = "static-1";
    recorded.trials[1].name = "waving-1";
    recorded.trials[1].kind = trial::Experiment::waving;
    recorded.trials[1].frequency_hz = 0.9;
    recorded.trials[1].amplitude_m = 0.035;
    files::write_json(folder_ / "diagnosis.json", diagnosis);
    return plan_of_second_session(recorded, folder_);
  }
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("selvedge-second-" + std::to_string(::getpid()));
};

TEST_F(SecondSessionTest, IsTheMotionThatTheDiagnosisForecasts) {
  const auto plan = plan_after({{"forecast", {{"like_trial", "waving-1"}, {"speed", 1.2}}}});
  ASSERT_TRUE(plan);
  ASSERT_EQ(plan->trials.size(), 1u);
  EXPECT_EQ(plan->trials[0].kind, trial::Experiment::waving);
  EXPECT_NEAR(plan->trials[0].frequency_hz, 1.08, 1e-12);
  EXPECT_NEAR(plan->trials[0].amplitude_m, 0.035, 1e-12);
}

TEST_F(SecondSessionTest, IsNoneWhereNothingIsForecast) {
  EXPECT_FALSE(plan_after({{"cause", "none"}}));
  EXPECT_FALSE(plan_after({{"forecast", {{"like_trial", "another"}, {"speed", 1.2}}}}));
}

}  // namespace
}  // namespace selvedge::station
