// A second session, simulated by the model itself with a fault that is known: predicted better with that fault added,
// and worse with another.
#include "station/confirmation.h"

#include <filesystem>

#include <gtest/gtest.h>
#include <unistd.h>

#include "files/whole_file.h"
#include "tests/diagnose/simulated_campaign.h"
#include "tests/refusal.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class ConfirmationTest : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  // The fit is the fabric's own; the diagnosis adds something to it.
  FirstAnswers answers(const std::string& effect, const std::string& parameter, double value) const {
    const std::vector<model::Parameter> base = model::base_parameters();
    const Eigen::VectorXd x = diagnose::base_of(late_, late_.material.stretch, late_.material.shear);
    json fitted = json::object(), none = json::object();
    for (size_t k = 0; k < base.size(); ++k) {
      none[base[k].name] = model::to_value(base[k], x(static_cast<Eigen::Index>(k)));
      fitted[base[k].name] = {{"value", none[base[k].name]}};
    }
    json with = none;
    with[parameter] = value;
    return {{{"parameters", fitted}, {"grid", {{"cells", 9}}}},
            {{"cause", effect},
             {"likeliest", effect},
             {"base", "nonlinear_drag"},
             {"grid_cells", {6, 9}},
             {"fit", {{"none", none}, {effect, with}}},
             {"forecast",
              {{"motion", "waving-1 at 1.2 times its speed"},
               {"before_mm", 6},
               {"interval_mm", {5, nullptr}},
               {"after_mm", 1}}}}};
  }
  Confirmation confirmed(const FirstAnswers& first) const {
    trial::Campaign second = diagnose::simulated_campaign(late_);
    second.trials = {second.trials[1]};
    return confirm(first, second, folder_, [](double, const std::string&) {});
  }

  static SimulatedSwatch late() {
    SimulatedSwatch c = diagnose::usual_fabric();
    c.delay_s = 0.012;
    return c;
  }
  const SimulatedSwatch late_ = late();
  const fs::path folder_ = fs::temp_directory_path() / ("selvedge-confirmation-" + std::to_string(::getpid()));
};

TEST_F(ConfirmationTest, TheRightEffectPredictsBetter) {
  const Confirmation c = confirmed(answers("camera_delay", "delay", 0.012));
  EXPECT_EQ(c.outcome, Confirmation::Outcome::confirmed) << c.before_mm << " → " << c.after_mm;
  EXPECT_LT(c.after_mm, 0.5 * c.before_mm);
  EXPECT_LT(c.after_mm, 1.5);                // damping and drag are the usual ones, not this swatch's
  EXPECT_DOUBLE_EQ(c.base_mm, c.before_mm);  // the same parameters here
  EXPECT_TRUE(fs::exists(folder_ / "simulated" / "waving-1.f32"));
  write_confirmation(c, folder_);
  const json told = files::read_json(folder_ / "confirmation.json");
  EXPECT_EQ(told.at("outcome"), "confirmed");
  EXPECT_EQ(told.at("trials").at("waving-1").at("after_mm").get<double>(), c.after_mm);
  EXPECT_TRUE(told.at("forecast").at("interval_mm").at(1).is_null());
  EXPECT_NE(files::read_whole(folder_ / "report.html").find("camera_delay"), std::string::npos);
}

// Errors grow with time: those of a second say nothing against a forecast of its first third.
TEST_F(ConfirmationTest, AsMuchIsComparedAsWasForecast) {
  FirstAnswers first = answers("camera_delay", "delay", 0.012);
  const Confirmation all = confirmed(first);
  EXPECT_TRUE(std::isinf(all.moving_s));
  first.diagnosis["forecast"]["moving_s"] = 0.25;
  const Confirmation beginning = confirmed(first);
  EXPECT_EQ(beginning.moving_s, 0.25);
  EXPECT_LT(beginning.after_mm, 0.8 * all.after_mm);
  EXPECT_NE(verdict_of(beginning).sentence.find("the first 0.2 s of motion"), std::string::npos);
}

TEST_F(ConfirmationTest, AWrongOneDoesNotAndIsSaidToBeRefuted) {
  const Confirmation c = confirmed(answers("camera_delay", "delay", -0.012));
  EXPECT_EQ(c.outcome, Confirmation::Outcome::refuted) << c.before_mm << " → " << c.after_mm;
  EXPECT_EQ(verdict_of(c).trust, report::Trust::none);
  EXPECT_NE(verdict_of(c).sentence.find("not confirmed"), std::string::npos);
}

TEST_F(ConfirmationTest, ASmallPartOfWhatWasForecastIsNoConfirmation) {
  const Confirmation c = confirmed(answers("camera_delay", "delay", 0.001));
  EXPECT_EQ(c.outcome, Confirmation::Outcome::better) << c.before_mm << " → " << c.after_mm;
  EXPECT_EQ(verdict_of(c).trust, report::Trust::limited);
}

TEST_F(ConfirmationTest, AnswersThatAreDamagedAreRefusedByTheirFiles) {
  const FirstAnswers whole = answers("camera_delay", "delay", 0.012);
  std::vector<FirstAnswers> damaged(7, whole);
  damaged[0].diagnosis["likeliest"] = 5;
  damaged[1].diagnosis["likeliest"] = "draught";  // of which it says nothing
  damaged[2].diagnosis["fit"]["none"] = "nothing";
  damaged[3].diagnosis["grid_cells"] = json::array();
  damaged[4].diagnosis["forecast"].erase("before_mm");
  damaged[5].fit["parameters"]["bend"] = 4e-5;
  damaged[6].diagnosis["forecast"]["moving_s"] = "long";
  for (const FirstAnswers& first : damaged) {
    const std::string said = refusal_of([&] { confirmed(first); });
    EXPECT_NE(said.find("diagnosis.json: found"), std::string::npos) << said;
    EXPECT_FALSE(fs::exists(folder_ / "simulated"));
  }
  FirstAnswers backwards = whole;
  backwards.diagnosis["forecast"]["moving_s"] = -1;
  const std::string refused = refusal_of([&] { confirmed(backwards); });
  EXPECT_NE(refused.find("diagnosis.json forecast.moving_s: found -1, expected a time above 0 s"), std::string::npos)
      << refused;
  EXPECT_FALSE(fs::exists(folder_ / "simulated"));
  fs::create_directories(folder_ / "diagnosis");
  files::write_whole(folder_ / "diagnosis" / "diagnosis.json", R"({"forecast": {"like_trial": 3}})");
  const std::string said = refusal_of([&] { plan_of_second_session({}, folder_ / "diagnosis"); });
  EXPECT_NE(said.find("diagnosis.json forecast: found"), std::string::npos) << said;
}

}  // namespace
}  // namespace selvedge::station
