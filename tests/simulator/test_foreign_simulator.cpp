// A simulator behind simulator/1: our own sheet gives what it gives in this process; one that breaks the protocol is
// refused in words that say how, and nothing of it is left running.
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>
#include <unistd.h>

#include "cloth/spline/simulate.h"
#include "station/simulator/foreign_simulator.h"
#include "tests/refusal.h"
#include "tests/simulator/broken_simulators.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;
using cloth::spline::SplineSheet;
using Eigen::Matrix3Xd;

class Foreign : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("selvedge_foreign_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    options_.log = folder_ / "simulator.log";
  }
  void TearDown() override { fs::remove_all(folder_); }

  // A square waved by its right corner for a quarter of a second.
  static cloth::Experiment waved() {
    cloth::Experiment e;
    std::vector<double> time_s;
    Matrix3Xd left(3, 31), right(3, 31);
    for (int k = 0; k <= 30; ++k) {
      time_s.push_back(0.01 * k);
      left.col(k) = Eigen::Vector3d(-0.12, 0, 0);
      right.col(k) = Eigen::Vector3d(0.12, 0.03 * (1 - std::cos(12 * time_s.back())), 0);
    }
    e.path = cloth::make_path(cloth::Hold::corners, time_s, left, right);
    for (int k = 0; k <= 30; ++k) e.sample_s.push_back(k / 120.0);
    return e;
  }
  static SplineSheet sheet() {
    const cloth::spline::Swatch swatch{0.3, 0.3};
    return make_spline_sheet(swatch, make_grid(swatch, cloth::Hold::corners, 0.3 / 6));
  }
  static cloth::Experiment begun(const SplineSheet& on) {
    cloth::Experiment e = waved();
    e.start_shape = hung_shape(on, e, 1);
    return e;
  }
  // What is said of a shell's deeds after it was told a run.
  std::string refusal_after(const std::string& then, const std::string& hello = hello_words()) {
    const SplineSheet on = sheet();
    return refusal_of([&] {
      options_.processes = 1;
      const ForeignSimulator simulator(shell_simulator(then, hello), options_);
      simulator.simulate(on, {begun(on)});
    });
  }
  fs::path folder_;
  ForeignOptions options_;
};

// Floats cross, so that half a micrometre is the most that may differ at a metre.
TEST_F(Foreign, OwnSheetGivesWhatItGivesInThisProcess) {
  const SplineSheet on = sheet();
  const ForeignSimulator simulator("'" SELVEDGE_BINARY "' simulator serve", options_);
  EXPECT_TRUE(simulator.begins_at_shapes());
  std::vector<cloth::Experiment> lanes(3, begun(on));
  const std::vector<model::Parameter> parameters = simulator.parameters();
  ASSERT_EQ(parameters.size(), model::base_parameters().size());
  std::vector<cloth::Experiment> own = lanes;
  for (size_t i = 0; i < lanes.size(); ++i)
    for (const model::Parameter& base : model::base_parameters()) {
      const double value = base.start * (base.name == "bend" ? 1 + 0.5 * static_cast<double>(i) : 1);
      model::Prediction here, there;
      here.experiment = own[i];
      there.experiment = lanes[i];
      base.apply(here, value);
      parameters[place_of(parameters, base.name)].apply(there, value);
      own[i] = here.experiment;
      lanes[i] = there.experiment;
    }
  for (const int round : {0, 1}) {
    SCOPED_TRACE(round);
    const std::vector<cloth::Trajectory> expected = simulate(on, own), found = simulator.simulate(on, lanes);
    ASSERT_EQ(found.size(), lanes.size());
    for (size_t i = 0; i < lanes.size(); ++i) {
      ASSERT_TRUE(found[i].finite);
      ASSERT_EQ(found[i].samples.size(), expected[i].samples.size());
      for (size_t t = 0; t < found[i].samples.size(); ++t)
        EXPECT_LT((found[i].samples[t] - expected[i].samples[t]).cwiseAbs().maxCoeff(), 5e-7) << i << " " << t;
    }
    EXPECT_GT((found[0].samples.back() - found[2].samples.back()).cwiseAbs().maxCoeff(), 1e-3);
  }
}

TEST_F(Foreign, WhatBreaksTheProtocolIsRefusedByName) {
  EXPECT_NE(
      refusal_after("echo nothing to see").find("simulator: its answer: found \"nothing to see\", expected one JSON"),
      std::string::npos);
  EXPECT_NE(refusal_after(R"(echo '{"run":1,"positions":[NaN]}')").find("not with NaN"), std::string::npos);
  EXPECT_NE(
      refusal_after(R"(echo '{"run":1,"positions":[1,2,3]}')").find("found 3 numbers, expected 7533 numbers: 31 times"),
      std::string::npos);
  EXPECT_NE(refusal_after(R"(echo '{"run":1,"floats":12}')").find("\"floats\": found \"12\", expected 7533 numbers"),
            std::string::npos);
  EXPECT_NE(refusal_after(R"(echo '{"run":7,"error":"no"}')").find("answered run 7, expected the answer to run 1"),
            std::string::npos);
  EXPECT_NE(refusal_after(R"(echo '{"run":1}')").find("none of \"positions\", \"floats\", \"doubles\", \"error\""),
            std::string::npos);
  EXPECT_NE(refusal_after(R"(echo '{"run":1,"floats":7533}'; head -c 30132 /dev/zero | tr '\000' '\377')").find("nan"),
            std::string::npos);
  EXPECT_NE(refusal_after("yes '[' | tr -d '\\n' | head -c 100000; echo").find("nest"), std::string::npos);
  EXPECT_NE(refusal_after("head -c 3000000 /dev/zero").find("without an end of line"), std::string::npos);
}

TEST_F(Foreign, OneThatExitsIsRefusedWithItsLastWords) {
  const std::string died = refusal_after("echo out of luck >&2; exit 3");
  EXPECT_NE(died.find("simulator ended with status 3"), std::string::npos) << died;
  EXPECT_NE(died.find("out of luck"), std::string::npos) << died;
  EXPECT_NE(refusal_after("kill -9 $$").find("was ended by signal 9"), std::string::npos);
  EXPECT_NE(refusal_after("exec >&-; sleep 60").find("closed its standard output"), std::string::npos);
  const std::string halfway = refusal_after(R"(echo '{"run":1,"floats":7533}'; printf too-little; exit 0)");
  EXPECT_NE(halfway.find("ended with status 0"), std::string::npos) << halfway;
  const std::string none = refusal_of([&] { ForeignSimulator("/no/such/simulator", options_); });
  EXPECT_NE(none.find("ended with status 127"), std::string::npos) << none;
}

TEST_F(Foreign, OneThatAnswersTooMuchIsRefusedAtTheNextRun) {
  const SplineSheet on = sheet();
  options_.processes = 1;
  const ForeignSimulator simulator(
      shell_simulator(R"(echo '{"run":1,"error":"no"}'; echo and more; read run; sleep 60)"), options_);
  EXPECT_FALSE(simulator.simulate(on, {begun(on)}).front().finite);
  EXPECT_EQ(simulator.last_divergence(), "no");
  std::string refusal;
  for (int i = 0; i < 100 && refusal.empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    refusal = refusal_of([&] { simulator.simulate(on, {begun(on)}); });
  }
  EXPECT_TRUE(refusal.find("wrote 9 bytes more than it was asked for") != std::string::npos ||
              refusal.find("found \"and more\"") != std::string::npos)
      << refusal;
}

bool is_running(const fs::path& number_file) {
  pid_t number = 0;
  std::ifstream(number_file) >> number;
  EXPECT_GT(number, 1);
  for (int i = 0; i < 100; ++i) {  // a killed orphan is gone as soon as init has reaped it
    std::ifstream stat("/proc/" + std::to_string(number) + "/stat");
    std::string pid, name, state;
    if (!(stat >> pid >> name >> state) || state == "Z") return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

TEST_F(Foreign, OneThatHangsIsEndedWithAllThatItStarted) {
  options_.run_limit_s = 0.5;
  const std::string here = folder_.string();
  const std::string hangs = "trap '' TERM; sleep 300 & echo $! > " + here + "/child; echo $$ > " + here +
                            "/itself; while true; do sleep 1; done";
  EXPECT_EQ(refusal_after(hangs), "simulator: did not answer within its time limit");
  EXPECT_FALSE(is_running(folder_ / "itself"));
  EXPECT_FALSE(is_running(folder_ / "child"));
  EXPECT_EQ(refusal_of([&] { ForeignSimulator("sleep 300", options_); }),
            "simulator: did not answer within its time limit");
}

TEST_F(Foreign, WhatItSaysFirstIsReadStrictly) {
  const auto refused = [&](const std::string& hello) {
    return refusal_of([&] { ForeignSimulator("echo '" + hello + "'; cat", options_); });
  };
  EXPECT_NE(refused("hello").find("what it says first: found \"hello\""), std::string::npos);
  EXPECT_NE(refused(R"({"protocol":"simulator/2"})").find("\"simulator/1\""), std::string::npos);
  EXPECT_NE(refused(hello_words(",\"colour\":1")).find("found the key \"colour\""), std::string::npos);
  EXPECT_NE(refused(hello_words(",\"at_once\":0")).find("\"at_once\": found \"0\", expected a whole number"),
            std::string::npos);
  const auto with_parameter = [&](const std::string& parameter) {
    return refused(R"({"protocol":"simulator/1","name":"x","holds":["corners"],"parameters":[)" + parameter + "]}");
  };
  EXPECT_NE(with_parameter("").find("at least one"), std::string::npos);
  EXPECT_NE(with_parameter(R"({"name":"k","default":1,"lower":0,"upper":2,"log":true})").find("above 0"),
            std::string::npos);
  EXPECT_NE(
      with_parameter(R"({"name":"k","default":3,"lower":1,"upper":2})").find("parameter k: \"default\": found \"3\""),
      std::string::npos);
  const SplineSheet on = sheet();
  cloth::Experiment edge = begun(on);
  edge.path.hold = cloth::Hold::top_edge;
  const ForeignSimulator corners_alone("echo '" + hello_words() + "'; cat", options_);
  EXPECT_NE(refusal_of([&] { corners_alone.simulate(on, {edge}); }).find("broken cannot hold a fabric by top_edge"),
            std::string::npos);
}

TEST(SimulatorProtocol, WhatIsSaidFirstComesBack) {
  SimulatorHello hello;
  hello.name = "one";
  hello.version = "2.1";
  hello.parameters = {{"k", "N/m", 1, 0.5, 2, true, true, {0.5, 2}}, {"c", "", -1, -2, 2, false, false, {}}};
  hello.holds = {cloth::Hold::top_edge_clamped, cloth::Hold::corners};
  hello.start_shape = true;
  hello.at_once = 5;
  hello.processes = 2;
  EXPECT_EQ(hello_line(hello_from(hello_line(hello), "here")), hello_line(hello));
}

}  // namespace
}  // namespace selvedge::station
