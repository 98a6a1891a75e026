// ./selvedge simulator check and fit --simulator, as a user calls them.
#include <filesystem>
#include <sstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "capture/trial/trial_writer.h"
#include "files/whole_file.h"
#include "tests/cli/run_binary.h"
#include "tests/fit/simulated_trial.h"
#include "tests/simulator/broken_simulators.h"

namespace selvedge::cli {
namespace {

namespace fs = std::filesystem;

class SimulatorCommand : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("selvedge_simulator_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  Ran check(const std::string& command) const {
    return run_binary("simulator check \"" + command + "\" --run-limit 120", folder_);
  }
  fs::path folder_;
};

size_t lines_with(const std::string& text, const std::string& begin) {
  std::istringstream lines(text);
  size_t count = 0;
  for (std::string line; std::getline(lines, line);) count += line.rfind(begin, 0) == 0;
  return count;
}

TEST_F(SimulatorCommand, ExamplesAndOurOwnSheetAreFoundGood) {
  const std::string examples = SELVEDGE_SOURCE_DIR "/examples/simulators/";
  for (const std::string& command : {"python3 " + examples + "mass_spring.py", std::string(SELVEDGE_EXAMPLE),
                                     std::string(SELVEDGE_BINARY " simulator serve")}) {
    const Ran ran = check(command);
    EXPECT_EQ(ran.exit_status, 0) << command << "\n" << ran.out << ran.err;
    EXPECT_EQ(lines_with(ran.out, "wrong"), 0u) << ran.out;
    EXPECT_GE(lines_with(ran.out, "ok"), 10u) << ran.out;
  }
}

TEST_F(SimulatorCommand, WhatIsWrongIsSaidOnOneLineAndEndsWithTwo) {
  files::write_whole(folder_ / "broken.sh", station::shell_simulator("echo what; cat"));
  const Ran ran = check("sh " + (folder_ / "broken.sh").string());
  EXPECT_EQ(ran.exit_status, 2);
  EXPECT_EQ(lines_with(ran.out, "wrong"), 1u) << ran.out;
  EXPECT_NE(ran.out.find("found \"what\", expected one JSON object on a line"), std::string::npos) << ran.out;
  EXPECT_EQ(ran.err, "");
  EXPECT_EQ(check("/no/such/simulator").exit_status, 2);
}

// The example's sheet hangs by its corners, has a parameter that does nothing, and moves its left corner.
TEST_F(SimulatorCommand, WrongPhysicsIsFound) {
  std::string text = files::read_whole(SELVEDGE_SOURCE_DIR "/examples/simulators/mass_spring.py");
  const auto replace = [&](const std::string& what, const std::string& by) {
    ASSERT_NE(text.find(what), std::string::npos) << what;
    text.replace(text.find(what), what.size(), by);
  };
  replace("shear, drag):", "shear, drag):\n    shear = 5");
  replace("HANG = 5, 6, 1e-3, 3.0", "HANG = 5, 6, 1e-3, 0.2");
  replace("x[i] = between(t, i / CELLS)", "x[i] = between(t, i / CELLS + 0.1)");
  files::write_whole(folder_ / "wrong.py", text);
  const Ran ran = check("python3 " + (folder_ / "wrong.py").string());
  EXPECT_EQ(ran.exit_status, 2);
  for (const char* finding : {"held points lie up to", "it is to hang at rest before time zero", "shear 10"}) {
    const size_t at = ran.out.find(finding);
    ASSERT_NE(at, std::string::npos) << finding << "\n" << ran.out;
    EXPECT_EQ(ran.out.substr(ran.out.rfind('\n', at) + 1, 5), "wrong") << finding << "\n" << ran.out;
  }
}

TEST_F(SimulatorCommand, AFitNamesTheSimulator) {
  trial::Campaign campaign;
  campaign.fabric = "test knit";
  for (const auto& [name, amplitude, seconds] : {std::tuple{"still", 0.0, 0.1}, std::tuple{"waved", 0.1, 0.4}}) {
    campaign.trials.push_back(fit::simulated_trial(name, amplitude, seconds, 7));
    trial::write_trial(campaign.trials.back(), folder_ / "campaign" / name);
  }
  trial::write_campaign_json(campaign, folder_ / "campaign");
  const std::string fit = "fit campaign --out out --cells 8 --simulator \"" SELVEDGE_EXAMPLE "\"";
  const Ran ran = run_binary(fit, folder_);
  ASSERT_EQ(ran.exit_status, 0) << ran.err;
  const nlohmann::json written = files::read_json(folder_ / "out" / "fit.json");
  EXPECT_EQ(written["model"], "masses and springs in C++");
  EXPECT_EQ(written["simulator"]["name"], "masses and springs in C++");
  EXPECT_EQ(written["parameters"].size(), 3u);
  EXPECT_LE(written["trials"]["waved"]["error_end"], written["trials"]["waved"]["error_start"]);
  EXPECT_NE(files::read_whole(folder_ / "out" / "report.html").find("masses and springs in C++"), std::string::npos);
  EXPECT_TRUE(fs::exists(folder_ / "out" / "simulated" / "waved.json"));
  EXPECT_EQ(run_binary("fit campaign --out out --like x --simulator cat", folder_).exit_status, 2);
  const Ran fabric = run_binary("fabrics --library library --add out/fit.json", folder_);
  EXPECT_EQ(fabric.exit_status, 2);
  EXPECT_NE(fabric.err.find("found a fit of masses and springs in C++"), std::string::npos) << fabric.err;
  // A diagnosis of another simulator begins neither with this fit, nor one without a simulator.
  files::write_whole(folder_ / "other.sh", station::shell_simulator("cat"));
  for (const char* with : {" --simulator 'sh other.sh'", ""}) {
    const Ran other = run_binary("diagnose campaign --out told --fit out" + std::string(with), folder_);
    EXPECT_EQ(other.exit_status, 2) << with;
    EXPECT_NE(other.err.find("--fit: found a fit of other recordings, of another drag law or simulator"),
              std::string::npos)
        << other.err;
    EXPECT_FALSE(fs::exists(folder_ / "told" / "diagnosis.json"));
  }
}

TEST_F(SimulatorCommand, AFitEndsWhereTheSimulatorDoes) {
  trial::Campaign campaign;
  campaign.trials.push_back(fit::simulated_trial("waved", 0.1, 0.4, 7));
  trial::write_trial(campaign.trials.back(), folder_ / "waved");
  files::write_whole(folder_ / "dies.sh", station::shell_simulator("echo no memory >&2; exit 4"));
  files::write_whole(folder_ / "diverges.sh",
                     station::shell_simulator(R"(echo '{"run":1,"error":"blew up"}'; cat >/dev/null)"));
  const Ran dies = run_binary("fit waved --out out --simulator 'sh dies.sh'", folder_);
  EXPECT_EQ(dies.exit_status, 2);
  EXPECT_NE(dies.err.find("ended with status 4"), std::string::npos) << dies.err;
  EXPECT_NE(dies.err.find("no memory"), std::string::npos) << dies.err;
  const Ran diverges = run_binary("fit waved --out out --simulator 'sh diverges.sh'", folder_);
  EXPECT_EQ(diverges.exit_status, 2);
  EXPECT_NE(diverges.err.find("diverges at its default values: blew up"), std::string::npos) << diverges.err;
  EXPECT_FALSE(fs::exists(folder_ / "out" / "fit.json"));
}

}  // namespace
}  // namespace selvedge::cli
