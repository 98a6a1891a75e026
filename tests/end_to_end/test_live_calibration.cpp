// `./selvedge calibrate --rig FILE` as a user goes it: simulated devices, the daemons up, the command, the daemons
// down.
#include <cstdlib>
#include <filesystem>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "calib/calibration_file.h"
#include "files/whole_file.h"
#include "rig/network.h"
#include "station/child_process.h"
#include "station/free_addresses.h"
#include "station/simulated_rig.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

class LiveCalibration : public testing::Test {
 protected:
  void SetUp() override {
    rig::ensure_local_multicast(static_cast<uint16_t>(station::free_bus_port()));
    const fs::path source = SELVEDGE_SOURCE_DIR;
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    station::write_simulated_rig({source / "tests/end_to_end/short-rig.toml",
                                  source / "tests/end_to_end/short-world.toml", source / "data/arms"},
                                 folder_);
    devices_ = std::make_unique<station::ChildProcess>(
        "devices",
        std::vector<std::string>{SELVEDGE_BINARY, "simulate-devices", "--config", (folder_ / "world.toml").string(),
                                 "--truth", (folder_ / "truth.json").string()},
        folder_ / "devices.log");
    EXPECT_EQ(run("rig up --config rig.toml"), 0) << output();
  }
  void TearDown() override {
    EXPECT_EQ(run("rig down --config rig.toml"), 0) << output();
    devices_.reset();
    if (!HasFailure()) fs::remove_all(folder_);
  }

  // Exit status of ./selvedge in the folder.
  int run(const std::string& arguments) {
    const int status = std::system(
        fmt::format("cd '{}' && '{}' {} > output 2>&1", folder_.string(), SELVEDGE_BINARY, arguments).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string output() const { return files::read_whole(folder_ / "output"); }

  const fs::path folder_ = fs::temp_directory_path() / fmt::format("selvedge-live-calibration-{}", ::getpid());
  std::unique_ptr<station::ChildProcess> devices_;
};

TEST_F(LiveCalibration, CalibratesTheRunningRigAndItsPosesCalibrateAgainWithoutIt) {
  ASSERT_EQ(run("calibrate --rig rig.toml --out live --export"), 0) << output();
  EXPECT_NE(output().find("verdict: "), std::string::npos) << output();
  for (const char* file :
       {"calibration.json", "report.html", "poses.json", "correspondences.csv", "camera.yaml", "projector.cameramodel"})
    EXPECT_TRUE(fs::is_regular_file(folder_ / "live" / file)) << file;
  const auto live = calib::read_calibration(folder_ / "live" / "calibration.json");
  ASSERT_TRUE(live.projector);

  geometry::Projection truth = live.camera;
  const nlohmann::json told = files::read_json(folder_ / "truth.json").at("camera");
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c)
      truth.matrix(r, c) = told.at("projection").at(static_cast<size_t>(r)).at(static_cast<size_t>(c));
  for (size_t i = 0; i < 5; ++i) truth.distortion[i] = told.at("distortion").at(i);
  for (const Eigen::Vector3d& point :
       {Eigen::Vector3d(0, 0, -0.15), Eigen::Vector3d(-0.12, 0.04, -0.02), Eigen::Vector3d(0.12, -0.04, -0.28)})
    EXPECT_LT((geometry::project(live.camera, point) - geometry::project(truth, point)).norm(), 1.0);

  ASSERT_EQ(run("calibrate live --out again"), 0) << output();
  const auto again = calib::read_calibration(folder_ / "again" / "calibration.json");
  EXPECT_LT((again.camera.matrix - live.camera.matrix).norm(), 1e-6 * live.camera.matrix.norm());
}

}  // namespace
}  // namespace selvedge
