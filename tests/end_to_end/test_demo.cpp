// The whole way once, as a user goes it: the demo's own command, every device simulated, every process real.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "calib/calibration_file.h"
#include "capture/trial/trial.h"
#include "files/whole_file.h"
#include "geometry/projection.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

// Exit status of a shell command.
int run(const std::string& command) {
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

geometry::Projection projection_from(const nlohmann::json& json) {
  geometry::Projection projection;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c)
      projection.matrix(r, c) = json.at("projection").at(static_cast<size_t>(r)).at(static_cast<size_t>(c));
  return projection;
}

// Largest distance between two cameras' pixels over the fabric's volume.
double largest_difference_px(const geometry::Projection& a, const geometry::Projection& b) {
  double largest = 0;
  for (const double x : {-0.15, 0.0, 0.15})
    for (const double y : {-0.05, 0.05})
      for (const double z : {-0.3, -0.15, 0.0}) {
        const Eigen::Vector4d point(x, y, z, 1);
        largest = std::max(largest, ((a.matrix * point).hnormalized() - (b.matrix * point).hnormalized()).norm());
      }
  return largest;
}

class Demo : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    runs_ = fs::temp_directory_path() / fmt::format("selvedge-end-to-end-{}", ::getpid());
    fs::remove_all(runs_);
    fs::create_directories(runs_);
    const fs::path here = fs::path(SELVEDGE_SOURCE_DIR) / "tests" / "end_to_end";
    status_ = run(fmt::format("{} demo --runs {} --name short --cells 6 --rig {} --world {} > {} 2>&1", SELVEDGE_BINARY,
                              runs_.string(), (here / "short-rig.toml").string(), (here / "short-world.toml").string(),
                              (runs_ / "output").string()));
  }
  static void TearDownTestSuite() {
    if (!testing::UnitTest::GetInstance()->Failed()) fs::remove_all(runs_);
  }
  static std::string output() { return files::read_whole(runs_ / "output"); }
  fs::path folder() const { return runs_ / "short"; }

  static fs::path runs_;
  static int status_;
};
fs::path Demo::runs_;
int Demo::status_ = -1;

TEST_F(Demo, WalksTheWholeWay) {
  // A session this short determines little: 0 and 1 both mean that it got to the verdict.
  ASSERT_TRUE(status_ == 0 || status_ == 1) << output();
  for (const char* file : {"calibration.json", "calibration/poses.json", "campaign.json", "fit.json", "report.html",
                           "truth.json", "calibration-watch.json", "waving-1/projector-check.csv"})
    EXPECT_TRUE(fs::is_regular_file(folder() / file)) << file << "\n" << output();
  const auto fit = files::read_json(folder() / "fit.json");
  EXPECT_EQ(fit.at("format"), "fit/1");
  EXPECT_EQ(fit.at("trials").size(), 3u);
}

TEST_F(Demo, CalibratesToTheRigThatWasSimulated) {
  ASSERT_TRUE(fs::exists(folder() / "calibration.json")) << output();
  const auto found = calib::read_calibration(folder() / "calibration.json");
  const auto truth = files::read_json(folder() / "truth.json");
  EXPECT_NE(found.verdict, "refused");
  EXPECT_LT(largest_difference_px(found.camera, projection_from(truth.at("camera"))), 1.0);
  ASSERT_TRUE(found.projector);
  EXPECT_LT(largest_difference_px(*found.projector, projection_from(truth.at("projector"))), 2.0);
}

TEST_F(Demo, WatchesThatNothingMovedAndNoFrameIsLate) {
  ASSERT_TRUE(fs::exists(folder() / "calibration-watch.json")) << output();
  const auto watch = files::read_json(folder() / "calibration-watch.json");
  for (const char* device : {"camera", "projector"})
    EXPECT_TRUE(watch.at(device).at("moved_since").is_null()) << watch.dump(2);
  for (const char* trial : {"waving-1", "robot-1"}) {
    EXPECT_LT(watch.at("trials").at(trial).at("projector").at("shift_px"), 2) << watch.dump(2);
    const auto& delay = watch.at("trials").at(trial).at("delay");
    if (!delay.at("known")) continue;
    EXPECT_LT(std::abs(delay.at("offset_s").get<double>()), 4 * delay.at("sd_s").get<double>()) << watch.dump(2);
  }
}

TEST_F(Demo, RecordsTrialsThatStartStillAndThenMove) {
  ASSERT_TRUE(fs::exists(folder() / "campaign.json")) << output();
  const trial::Campaign campaign = trial::read_campaign(folder());
  ASSERT_EQ(campaign.trials.size(), 3u);
  for (const trial::Trial& trial : campaign.trials) {
    EXPECT_EQ(trial.state, trial::State::complete) << trial.name;
    ASSERT_TRUE(trial.frames) << trial.name;
    EXPECT_GE(trial.frames->time_s.front(), 0) << trial.name;
    const Eigen::Matrix3Xd& right = trial.corners.right;
    double travel = 0;
    for (Eigen::Index i = 0; i < right.cols(); ++i)
      if (right.col(i).allFinite()) travel = std::max(travel, (right.col(i) - right.col(0)).norm());
    if (trial.experiment == trial::Experiment::static_hang) EXPECT_LT(travel, 0.003) << trial.name;
    else EXPECT_GT(travel, 0.03) << trial.name;
    EXPECT_EQ(trial.robot.has_value(), trial.experiment == trial::Experiment::robot) << trial.name;
  }
}

TEST_F(Demo, LeavesNoProcessBehind) {
  for (const auto& process : fs::directory_iterator("/proc")) {
    std::ifstream file(process.path() / "cmdline");
    const std::string command{std::istreambuf_iterator<char>(file), {}};
    EXPECT_EQ(command.find((folder() / "rig.toml").string()), std::string::npos) << process.path();
    EXPECT_EQ(command.find((folder() / "world.toml").string()), std::string::npos) << process.path();
  }
}

TEST_F(Demo, RefusesANameThatIsTaken) {
  fs::create_directories(runs_ / "taken");
  EXPECT_EQ(run(fmt::format("{} demo --runs {} --name taken > /dev/null 2>&1", SELVEDGE_BINARY, runs_.string())), 2);
}

}  // namespace
}  // namespace selvedge
