// `./selvedge calibrate FOLDER` as a lab without a rig would run it: folders of correspondences, and of images.
#include <algorithm>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "calib/image_folder.h"
#include "hardware_sim/synthetic_grid/synthetic_recording.h"
#include "cli/verify/proofs/damaged_trials.h"
#include "run_binary.h"

namespace selvedge::cli {
namespace {

namespace fs = std::filesystem;
using hardware_sim::SyntheticOptions;

class Calibrate : public testing::Test {
 protected:
  void SetUp() override { fs::create_directory(working_folder()); }
  fs::path working_folder() const { return scratch_.path() / "working"; }
  fs::path lab() const { return scratch_.path() / "lab"; }
  fs::path out() const { return working_folder() / "out"; }

  Ran calibrate(const std::string& more = "") {
    return run_binary("calibrate ../lab --out out " + more, working_folder());
  }
  Ran calibrate(const calib::Poses& poses, const std::string& more = "") {
    calib::write_poses(poses, lab());
    return calibrate(more);
  }
  Ran calibrate(const SyntheticOptions& made) { return calibrate(hardware_sim::make_synthetic_poses(made).poses); }
  nlohmann::json result() const { return files::read_json(out() / "calibration.json"); }

  // Exit 2 and one line that says why; the report is there, and a result that nobody can take matrices from.
  void expect_refused(const Ran& ran, const std::string& why) {
    EXPECT_EQ(ran.exit_status, 2) << ran.out;
    EXPECT_EQ(ran.out, "");
    EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
    EXPECT_NE(ran.err.find(why), std::string::npos) << ran.err;
    EXPECT_TRUE(fs::exists(out() / "report.html"));
    EXPECT_FALSE(fs::exists(out() / "camera.yaml"));
    EXPECT_EQ(result()["verdict"], "refused");
    EXPECT_TRUE(result()["camera"]["projection"].is_null());
    EXPECT_NE(result()["advice"].get<std::string>().find(why), std::string::npos);
  }
  void expect(const Ran& ran, const std::string& verdict, const std::string& advice) {
    EXPECT_EQ(ran.exit_status, 0) << ran.err;
    EXPECT_EQ(ran.err.find("refused"), std::string::npos) << ran.err;
    ASSERT_TRUE(fs::exists(out() / "calibration.json")) << ran.err;
    EXPECT_EQ(result()["verdict"], verdict) << result()["advice"];
    EXPECT_NE(result()["advice"].get<std::string>().find(advice), std::string::npos) << result()["advice"];
    EXPECT_NE(ran.out.find(advice), std::string::npos) << ran.out;
  }

  ScratchFolder scratch_;
};

TEST_F(Calibrate, TwelvePosesAreGoodAndExported) {
  const Ran ran = calibrate(hardware_sim::make_synthetic_poses({}).poses, "--export");
  expect(ran, "good", "Expected error at the fabric");
  for (const char* file :
       {"report.html", "camera.yaml", "projector.yaml", "camera.cameramodel", "projector.cameramodel"})
    EXPECT_TRUE(fs::exists(out() / file)) << file;
  EXPECT_LT(result()["camera"]["predicted_sd_px"], 0.08);
  EXPECT_EQ(result()["inputs"]["correspondences"].size(), 360u);
  EXPECT_NE(ran.out.find("next pose that would help most"), std::string::npos) << ran.out;
  // Anyone can solve it again from the result alone.
  ASSERT_EQ(run_binary("calibrate out/calibration.json --out again", working_folder()).exit_status, 0);
  EXPECT_EQ(files::read_json(working_folder() / "again/calibration.json")["camera"]["projection"],
            result()["camera"]["projection"]);
}

TEST_F(Calibrate, FlatGridIsRefused) {
  SyntheticOptions made;
  made.grid.fold_rad = 0;
  expect_refused(calibrate(hardware_sim::make_synthetic_poses(made).poses, "--export"), "flat");
}

TEST_F(Calibrate, SinglePoseIsRefused) {
  SyntheticOptions made;
  made.poses = 1;
  expect_refused(calibrate(made), "single pose");
}

TEST_F(Calibrate, SwappedLabelsAreNamed) {
  SyntheticOptions made;
  made.swapped_share = 0.2;
  expect(calibrate(made), "good", "with the label of another marker");
  EXPECT_EQ(result()["rejected"].size(), 72u);
}

TEST_F(Calibrate, ACameraTurnedBetweenPosesIsNamedWithThePosesOnBothSides) {
  SyntheticOptions made;
  made.knocked_pose = 5;
  expect(calibrate(made), "doubtful", "The camera moved between poses 4 and 5: in poses 0 to 4 it was turned by 0.5");
  const nlohmann::json event = result()["camera"]["events"].at(0);
  EXPECT_EQ(event["last_pose_before"], 4);
  EXPECT_EQ(event["pose"], 5);
  EXPECT_NEAR(event["turned_deg"], 0.5, 0.1);
  EXPECT_NEAR(event["moved_px_at_fabric"], 0.5 * M_PI / 180 * 1400, 2);
}

// One pose on one side of the knock: told from a board that moved by the projector, which the pose fits.
TEST_F(Calibrate, ACameraTurnedBeforeTheLastPoseOrAfterTheFirstIsNamed) {
  SyntheticOptions made;
  made.poses = 8;
  made.knocked_pose = 7;
  expect(calibrate(made), "doubtful",
         "Pose 7 is left out, for the camera it does not fit the others: the camera was turned by 0.");
  made.knocked_pose = 1;
  expect(calibrate(made), "good",
         "Pose 0 is left out, for the camera it does not fit the others: the camera was turned by 0.");
}

TEST_F(Calibrate, AProjectorTurnedBetweenPosesIsNamed) {
  SyntheticOptions made;
  made.knocked_pose = 7;
  made.knocked_projector = true;
  expect(calibrate(made), "doubtful", "The projector moved between poses 6 and 7");
}

TEST_F(Calibrate, AMovedPoseIsNamed) {
  SyntheticOptions made;
  made.moved_pose = 3;
  expect(calibrate(made), "good", "Pose 3 is left out");
}

TEST_F(Calibrate, OccludedMergedAndFalseSightingsAreSurvivedAndNamed) {
  const hardware_sim::SyntheticPoses truth = hardware_sim::make_synthetic_poses({});
  calib::Poses poses = truth.poses;
  for (size_t i = 0; i < poses.rows.size(); i += 9)
    poses.rows[i].camera = poses.rows[i].projector = std::nullopt;  // hidden
  for (size_t i = 4; i + 1 < poses.rows.size(); i += 37)            // one blob for two
    if (poses.rows[i].camera && poses.rows[i + 1].camera) {
      const Eigen::Vector2d merged = (*poses.rows[i].camera + *poses.rows[i + 1].camera) / 2;
      poses.rows[i].camera = poses.rows[i + 1].camera = merged;
    }
  for (size_t i = 7; i < poses.rows.size(); i += 41)
    poses.rows[i].camera =
        Eigen::Vector2d(40 + 3 * static_cast<double>(i), 900 - 2 * static_cast<double>(i));  // a reflection
  expect(calibrate(poses), "good", "Rejected");
  EXPECT_GE(result()["rejected"].size(), 18u);
  geometry::Projection camera;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) camera.matrix(r, c) = result()["camera"]["projection"][r][c];
  for (int i = 0; i < 5; ++i) camera.distortion[i] = result()["camera"]["distortion"][i];
  camera.width_px = 1280;
  camera.height_px = 1024;
  EXPECT_LT(hardware_sim::volume_error_px(camera, truth.camera, truth.poses), 0.12);
}

TEST_F(Calibrate, DamagedInputIsRefusedAndNothingIsWritten) {
  calib::write_poses(hardware_sim::make_synthetic_poses({}).poses, lab());
  const std::string rows = files::read_whole(lab() / "correspondences.csv"),
                    header = files::read_whole(lab() / "poses.json");
  const auto expect_nothing = [&](const char* culprit) {
    const Ran ran = calibrate();
    EXPECT_EQ(ran.exit_status, 2) << culprit;
    EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
    EXPECT_NE(ran.err.find(culprit), std::string::npos) << ran.err;
    EXPECT_FALSE(fs::exists(out())) << culprit;
  };
  files::write_whole(lab() / "correspondences.csv", rows.substr(0, rows.size() / 2));
  expect_nothing("correspondences.csv");
  files::write_whole(lab() / "correspondences.csv",
                     "pose,marker,x,y,z,camera_u,camera_v,projector_u,projector_v\n0,0,nan,0,0,1,1,1,1\n");
  expect_nothing("correspondences.csv:2");
  files::write_whole(lab() / "correspondences.csv",
                     "pose,marker,x,y,z,camera_u,camera_v,projector_u\n0,0,0,0,0,1,1,1\n");
  expect_nothing("projector_v");
  fs::remove(lab() / "correspondences.csv");
  expect_nothing("correspondences.csv");
  files::write_whole(lab() / "correspondences.csv", rows);
  files::write_whole(lab() / "poses.json", "{\"format\": \"poses/2\"}");
  expect_nothing("poses/1");
  files::write_whole(lab() / "poses.json",
                     std::string(header).replace(header.find("fabric_volume_m"), 15, "fabric_volume_x"));
  expect_nothing("fabric_volume_m");
}

// Hidden, merged and false blobs in the marker images of four poses, no rough camera: labels come from the tracker
// alone.
TEST_F(Calibrate, ImagesAndTrackerFilesCalibrate) {
  SyntheticOptions made;
  made.poses = 4;
  made.seed = 21;
  const hardware_sim::SyntheticPoses truth = hardware_sim::make_synthetic_poses(made);
  calib::ImageFolder images{truth.poses, hardware_sim::record_images(truth, made.grid, {})};
  images.header.rows.clear();
  const auto paint = [&](size_t pose, const Eigen::Vector2d& at, double radius, unsigned char grey) {
    calib::GreyImage& image = images.poses[pose].marker_image;
    for (int row = 0; row < image.rows(); ++row)
      for (int column = 0; column < image.cols(); ++column)
        if ((Eigen::Vector2d(column, row) - at).norm() < radius) image(row, column) = grey;
  };
  const auto pixel = [&](size_t pose, int marker) {
    return geometry::project(
        truth.camera, truth.world_from_grid[pose] * calib::marker_positions(made.grid)[static_cast<size_t>(marker)]);
  };
  paint(0, pixel(0, 7), 12, 12);                                                           // hidden
  paint(1, pixel(1, 3) + Eigen::Vector2d(9, 0), 5, 200);                                   // merged with a reflection
  for (int i = 0; i < 6; ++i) paint(2, Eigen::Vector2d(60 + 40 * i, 70 + 3 * i), 5, 210);  // false
  calib::write_image_folder(images, lab());
  const Ran ran = calibrate();
  EXPECT_EQ(ran.exit_status, 0) << ran.err;
  EXPECT_NE(result()["verdict"], "refused") << result()["advice"];
  EXPECT_NE(ran.out.find("bright blobs are no marker"), std::string::npos) << ran.out;
  std::string whys;
  const nlohmann::json found = result();
  for (const auto& r : found["rejected"]) whys += r["why"].get<std::string>() + "\n";
  EXPECT_NE(whys.find("hidden"), std::string::npos) << whys;
  EXPECT_NE(whys.find("merged"), std::string::npos) << whys;
  EXPECT_LT(result()["camera"]["rms_px"], 0.5);
  EXPECT_LT(result()["projector"]["rms_px"], 0.5);
}

}  // namespace
}  // namespace selvedge::cli
