// Trials to and from other formats: what is exported reads back equal in h5py, what is imported is a trial like any
// other.
#include <cstdlib>
#include <fstream>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <lcm/eventlog.h>
#include <lcm/lcm.h>
#include <opencv2/imgcodecs.hpp>
#include <selvedge_rig/arm_status_t.hpp>
#include <selvedge_rig/corner_sample_t.hpp>
#include <selvedge_rig/frame_stamp_t.hpp>
#include <selvedge_rig/session_status_t.hpp>
#include <unistd.h>

#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "station/exchange/hdf5_export.h"
#include "station/exchange/import_mapping.h"
#include "station/exchange/lcm_export.h"
#include "station/exchange/mcap_export.h"
#include "station/exchange/obj_sequence.h"
#include "station/exchange/trial_preview.h"
#include "tests/keep_page.h"
#include "tests/needs_package.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;

class Exchange : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  // A small trial with everything in it, one corner hidden once.
  trial::Trial written() {
    trial::Trial t;
    t.experiment = trial::Experiment::robot;
    t.fabric = {"denim", 0.3, 0.25, 0.021, true};
    t.starts_at_rest = true;
    geometry::Projection p;
    p.width_px = 24;
    p.height_px = 16;
    p.matrix << 100, 0, 12, 0.1, 0, 101, 8, 0.2, 0, 0, 1, 1.5;
    p.distortion = {-0.05, 0.01, 1e-4, -2e-4, 0.003};
    t.camera = t.projector = p;
    t.pattern = trial::StripePattern{"horizontal", 16, 0.5, 3};
    t.frame_rate_hz = 30;
    t.exposure_s = 0.002;
    t.mocap_rate_hz = 120;
    t.mocap_noise_m = 2e-4;
    std::mt19937 random(4);
    std::normal_distribution<double> normal;
    const auto points = [&](Eigen::Index n) -> Eigen::Matrix3Xd {
      return Eigen::Matrix3Xd::NullaryExpr(3, n, [&] { return normal(random); });
    };
    for (int i = 0; i < 7; ++i) t.corners.time_s.push_back(i / 120.0);
    t.corners.left = points(7);
    t.corners.right = points(7);
    t.corners.left.col(3).setConstant(std::nan(""));
    t.robot = trial::Robot{t.corners.time_s, points(7), points(7)};
    t.frames = trial::Frames{{0, 1, 3}, {0.01, 0.043, 0.11}, {}};
    std::vector<trial::GreyImage> images;
    for (int i = 0; i < 3; ++i)
      images.push_back(
          trial::GreyImage::NullaryExpr(16, 24, [&] { return static_cast<unsigned char>(random() % 256); }));
    trial::write_trial(t, folder_ / "trial", images);
    return trial::read_trial(folder_ / "trial");
  }

  const fs::path folder_ = fs::temp_directory_path() / fmt::format("selvedge-exchange-{}", ::getpid());
};

// Reads every number from the HDF5 file, and from the trial's own files by other means.
constexpr const char* kCheck = R"(
import csv, json, sys
import h5py, numpy as np
trial, path = sys.argv[1:]
f = h5py.File(path, "r")
about = json.load(open(trial + "/trial.json"))
def table(name):
    rows = list(csv.reader(open(trial + "/" + name)))
    return np.array([[float(v) if v else np.nan for v in row] for row in rows[1:]])
def same(name, found, wanted, unit):
    assert np.array_equal(np.asarray(found), wanted, equal_nan=True), name
    have = found.attrs["unit"]
    assert (have.decode() if isinstance(have, bytes) else have) == unit, (name, have)
text = lambda v: v.decode() if isinstance(v, bytes) else v
assert text(f.attrs["format"]) == "selvedge-trial/1" and text(f.attrs["experiment"]) == about["experiment"]
assert f["fabric"].attrs["mass_kg"] == 0.021 and text(f["fabric"].attrs["name"]) == "denim"
c = table("corners.csv")
same("time", f["corners/time"], c[:, 0], "s")
same("left", f["corners/left"], c[:, 1:4], "m"); same("right", f["corners/right"], c[:, 4:7], "m")
r = table("robot.csv")
same("robot", f["robot/measured"], r[:, 4:7], "m"); same("commanded", f["robot/commanded"], r[:, 1:4], "m")
n = table("frames.csv")
same("frame times", f["frames/time"], n[:, 1], "s"); same("numbers", f["frames/number"], n[:, 0].astype(int), "1")
projection = np.array([[100, 0, 12, 0.1], [0, 101, 8, 0.2], [0, 0, 1, 1.5]])
same("camera", f["camera/projection"], projection, "px, from metres")
assert f["frames/image"].shape == (3, 16, 24) and f["frames/image"].dtype == np.uint8
raw = np.fromfile(trial + "/raw", dtype=np.uint8).reshape(3, 16, 24)
same("image", f["frames/image"], raw, "grey level")
same("gravity", f["gravity"], np.array([0, 0, -9.81]), "m/s^2")
print("equal")
)";

TEST_F(Exchange, AnExportedTrialReadsBackEqualInH5py) {
  SELVEDGE_NEEDS(std::system("/usr/bin/python3 -c 'import h5py' > /dev/null 2>&1") == 0, "python3-h5py",
                 "reading the HDF5 file back by another program");
  const trial::Trial t = written();
  export_hdf5(t, folder_ / "trial.h5");
  std::ofstream raw(folder_ / "trial" / "raw", std::ios::binary);
  for (size_t i = 0; i < t.frames->number.size(); ++i) {
    const trial::GreyImage image = trial::read_frame(t, i);
    raw.write(reinterpret_cast<const char*>(image.data()), image.size());
  }
  raw.close();
  files::write_whole(folder_ / "check.py", kCheck);
  const int status = std::system(
      fmt::format("/usr/bin/python3 '{0}/check.py' '{0}/trial' '{0}/trial.h5' > '{0}/output' 2>&1", folder_.string())
          .c_str());
  EXPECT_EQ(status, 0) << files::read_whole(folder_ / "output");
}

struct Read {
  int64_t time_us;
  std::string channel;
  std::vector<char> bytes;
};

// By liblcm's own reader.
std::vector<Read> read_log(const fs::path& path) {
  std::vector<Read> events;
  lcm_eventlog_t* log = lcm_eventlog_create(path.c_str(), "r");
  if (log == nullptr) return events;
  while (lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log)) {
    const char* data = static_cast<const char*>(event->data);
    EXPECT_EQ(event->eventnum, static_cast<int64_t>(events.size()));
    events.push_back({event->timestamp,
                      std::string(event->channel, static_cast<size_t>(event->channellen)),
                      {data, data + event->datalen}});
    lcm_eventlog_free_event(event);
  }
  lcm_eventlog_destroy(log);
  return events;
}

template <class Message>
std::vector<Message> on_channel(const std::vector<Read>& events, const std::string& channel) {
  std::vector<Message> messages;
  for (const Read& event : events) {
    if (event.channel != channel) continue;
    Message message;
    EXPECT_EQ(message.decode(event.bytes.data(), 0, static_cast<int>(event.bytes.size())),
              static_cast<int>(event.bytes.size()))
        << channel;
    EXPECT_EQ(message.utime, event.time_us);
    EXPECT_EQ(message.sequence, static_cast<int64_t>(messages.size()) + 1);
    messages.push_back(message);
  }
  return messages;
}

TEST_F(Exchange, AnLcmLogHoldsTheBussMessagesAtTheirTimes) {
  const trial::Trial t = written();
  files::write_whole(folder_ / "rig.toml",
                     "[bus]\nport = 7667\n[arm]\nbackend = \"rtde\"\nmodel = \"arm.toml\"\nbase_position_m = [0.5, "
                     "0.25, -1.0]\nbase_rpy_deg = [0, 0, 90]\n");
  const LcmExported exported = export_lcm(folder_ / "trial", folder_ / "trial.lcm");
  const std::vector<Read> events = read_log(folder_ / "trial.lcm");
  ASSERT_EQ(static_cast<int64_t>(events.size()), exported.events);
  EXPECT_EQ(exported.events, 7 + 7 + 3 + 1 + 2);  // corners, arm, frames, stripes, begin and end
  for (size_t i = 1; i < events.size(); ++i) EXPECT_GE(events[i].time_us, events[i - 1].time_us);

  const auto corners = on_channel<selvedge_rig::corner_sample_t>(events, "TRACKER_CORNERS");
  ASSERT_EQ(corners.size(), 7u);
  for (size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(corners[i].utime, std::llround(1e6 * t.corners.time_s[i]));
    EXPECT_EQ(corners[i].frame_number, static_cast<int64_t>(i));
    ASSERT_EQ(corners[i].name, (std::vector<std::string>{"left", "right"}));
    EXPECT_EQ(corners[i].occluded[0] != 0, i == 3);
    if (i != 3) { EXPECT_EQ(corners[i].x_m[0], t.corners.left(0, static_cast<Eigen::Index>(i))); }
    EXPECT_EQ(corners[i].z_m[1], t.corners.right(2, static_cast<Eigen::Index>(i)));
  }
  const auto stamps = on_channel<selvedge_rig::frame_stamp_t>(events, "CAMERA_STAMP");
  ASSERT_EQ(stamps.size(), 3u);
  EXPECT_EQ(stamps[2].frame_number, 3);
  EXPECT_EQ(stamps[2].utime, 110000);
  EXPECT_EQ(stamps[2].exposure_s, 0.002);
  const auto arm = on_channel<selvedge_rig::arm_status_t>(events, "ARM_ARM");
  ASSERT_EQ(arm.size(), 7u);
  for (Eigen::Index i = 0; i < 7; ++i) {  // x of the world is -y of a base that is turned by 90 degrees
    EXPECT_NEAR(arm[static_cast<size_t>(i)].tool_m[1], -(t.robot->measured(0, i) - 0.5), 1e-12);
    EXPECT_NEAR(arm[static_cast<size_t>(i)].tool_commanded_m[2], t.robot->commanded(2, i) + 1.0, 1e-12);
  }
  const auto status = on_channel<selvedge_rig::session_status_t>(events, "SESSION_STATUS");
  ASSERT_EQ(status.size(), 2u);
  EXPECT_EQ(status[0].trial, "trial");
  EXPECT_EQ(status[1].frames_written, 3);
}

TEST_F(Exchange, AnLcmLogOfACampaignReplaysAsABus) {
  trial::Trial t = written();
  t.markers =
      trial::Markers{{0.0, 0.0, 1 / 120.0}, {4, 7, 4}, {{0, 0}, {0.1, 0}, {0, 0}}, Eigen::Matrix3Xd::Random(3, 3)};
  t.robot.reset();
  t.frames.reset();
  trial::write_trial(t, folder_ / "second", {});
  files::write_whole(folder_ / "campaign.json",
                     R"({"format": "campaign/1", "fabric": "denim", "trials": ["trial", "second"]})");
  EXPECT_EQ(export_lcm(folder_, folder_ / "both.lcm").trials, 2);
  const auto corners = on_channel<selvedge_rig::corner_sample_t>(read_log(folder_ / "both.lcm"), "TRACKER_CORNERS");
  ASSERT_EQ(corners.size(), 14u);
  EXPECT_GT(corners[7].utime, corners[6].utime + 1'000'000);
  EXPECT_EQ(corners[7].name, (std::vector<std::string>{"left", "right", "m4", "m7"}));
  EXPECT_EQ(corners[7].y_m[3], t.markers->position(1, 1));

  // The same file as LCM's own transport, as a daemon would hear it.
  lcm_t* bus = lcm_create(("file://" + (folder_ / "both.lcm").string() + "?speed=0").c_str());
  ASSERT_NE(bus, nullptr);
  int heard = 0;
  lcm_subscribe(
      bus, "TRACKER_CORNERS", [](const lcm_recv_buf_t*, const char*, void* count) { ++*static_cast<int*>(count); },
      &heard);
  while (lcm_handle(bus) == 0) {}
  lcm_destroy(bus);
  EXPECT_EQ(heard, 14);
}

TEST_F(Exchange, AnLcmLogOfARunNamesEachFabricsTrials) {
  written();
  fs::create_directories(folder_ / "run" / "denim");
  fs::copy(folder_ / "trial", folder_ / "run" / "denim" / "trial", fs::copy_options::recursive);
  files::write_whole(folder_ / "run" / "denim" / "campaign.json",
                     R"({"format": "campaign/1", "fabric": "denim", "trials": ["trial"]})");
  EXPECT_EQ(export_lcm(folder_ / "run", folder_ / "run.lcm").trials, 1);
  const auto status = on_channel<selvedge_rig::session_status_t>(read_log(folder_ / "run.lcm"), "SESSION_STATUS");
  ASSERT_EQ(status.size(), 2u);
  EXPECT_EQ(status[0].trial, "denim/trial");
}

TEST_F(Exchange, LeavesNoHalfLcmLog) {
  fs::create_directories(folder_ / "empty");
  EXPECT_THROW(export_lcm(folder_ / "empty", folder_ / "x.lcm"), BadInput);
  written();
  EXPECT_ANY_THROW(export_lcm(folder_ / "trial", folder_ / "no-folder" / "x.lcm"));
  EXPECT_FALSE(fs::exists(folder_ / "x.lcm"));
}

TEST_F(Exchange, LeavesNothingHalfWritten) {
  trial::Trial t = written();
  files::write_whole(t.frames->path[1], "no picture");
  EXPECT_ANY_THROW(export_hdf5(t, folder_ / "trial.h5"));
  EXPECT_FALSE(fs::exists(folder_ / "trial.h5"));
  EXPECT_FALSE(fs::exists(folder_ / "trial.h5.part"));
}

TEST_F(Exchange, AFolderIsNotWrittenOver) {
  const trial::Trial t = written();
  fs::create_directories(folder_ / "there");
  for (const fs::path& path : {folder_ / "there", folder_ / "nowhere" / "file"}) {
    EXPECT_THROW(export_hdf5(t, path), BadInput) << path;
    EXPECT_THROW(export_lcm(folder_ / "trial", path), BadInput) << path;
    EXPECT_THROW(export_mcap(t, {}, path), BadInput) << path;
  }
  EXPECT_FALSE(fs::exists(folder_ / "there.part"));
}

TEST_F(Exchange, WritesAMotionAsObjFiles) {
  SimulatedMotion motion;
  motion.uv_m = {{0, 0}, {0.3, 0}, {0, 0.2}};
  motion.triangles = {{0, 1, 2}};
  motion.time_s = {0, 0.1};
  motion.position = {Eigen::Matrix3Xf::Identity(3, 3), 2 * Eigen::Matrix3Xf::Identity(3, 3)};
  EXPECT_EQ(write_obj_sequence(motion, folder_ / "obj"), 2u);
  const std::string text = files::read_whole(folder_ / "obj" / "frame_00002.obj");
  EXPECT_NE(text.find("v 2.000000 0.000000 0.000000\n"), std::string::npos);
  EXPECT_NE(text.find("vt 1.000000 1.000000\n"), std::string::npos);
  EXPECT_NE(text.find("f 1/1 2/2 3/3\n"), std::string::npos);
  EXPECT_NE(files::read_whole(folder_ / "obj" / "times.csv").find("frame_00002.obj,0.1"), std::string::npos);
}

TEST_F(Exchange, RefusesATriangleVertexThatNoMeshHas) {
  fs::create_directories(folder_ / "simulated");
  files::write_whole(folder_ / "simulated" / "waving.f32", std::string(36, '\0'));
  for (const char* vertex : {"3", "-1", "0.5", "6.66667e+23", "\"0\""}) {
    files::write_whole(
        motion_path(folder_, "waving"),
        std::string(R"({"uv_m": [[0, 0], [1, 0], [0, 1]], "time_s": [0], "triangles": [[0, 1, )") + vertex + "]]}");
    EXPECT_THROW(read_simulated_motion(folder_, "waving"), BadInput) << vertex;
  }
}

TEST_F(Exchange, ImportsMarkersWithOtherUnitsAndAxes) {
  // Millimetres and milliseconds, y up.
  files::write_whole(folder_ / "dots.csv",
                     "t,id,x,y,z,u,v\n0,0,-150,0,10,0,0\n0,1,150,0,10,300,0\n0,2,0,-200,12,150,200\n10,0,-150,0,10,0,"
                     "0\n10,1,151,0,10,300,0\n10,2,1,-201,12,150,200\n");
  const std::string mapping =
      "[trial]\nname = \"theirs\"\nkind = \"waving\"\n[fabric]\nname = \"x\"\nwidth_m = 0.3\nheight_m = 0.3\nmass_kg = "
      "0.02\n"
      "[corners]\nleft_marker = 0\nright_marker = 1\n[markers]\nfile = \"dots.csv\"\ntime = \"t\"\nmarker = "
      "\"id\"\nposition = [\"x\", \"y\", \"z\"]\nflat = [\"u\", \"v\"]\n"
      "[units]\nlength_m = 0.001\ntime_s = 0.001\naxes = [\"x\", \"-z\", \"y\"]\n";
  files::write_whole(folder_ / "map.toml", mapping);
  const trial::Trial t = trial::read_trial(import_recording(folder_ / "map.toml", folder_));
  ASSERT_EQ(t.corners.time_s, (std::vector<double>{0, 0.01}));
  EXPECT_LT((t.corners.right.col(1) - Eigen::Vector3d(0.151, -0.01, 0)).norm(), 1e-9);
  EXPECT_LT((t.markers->position.col(5) - Eigen::Vector3d(0.001, -0.012, -0.201)).norm(), 1e-9);
  EXPECT_LT((t.markers->uv[5] - Eigen::Vector2d(0.15, 0.2)).norm(), 1e-9);
  // Its page: gravity down, three moments, no doubt; a recording in millimetres is doubted and drawn as it lies.
  write_preview(t, folder_ / "preview.html");
  std::string page = files::read_whole(folder_ / "preview.html");
  keep_page(folder_ / "preview.html", "import");
  const auto count = [&](const std::string& part) {
    size_t found = 0;
    for (size_t at = page.find(part); at != std::string::npos; at = page.find(part, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("class=\"gravity\""), 3u);
  EXPECT_EQ(count("class=\"corner\""), 12u);  // two corners, two views, three moments
  EXPECT_EQ(count("<circle"), 18u);
  EXPECT_NE(page.find("look as those of a hung fabric do"), std::string::npos) << page.substr(0, 4000);
  trial::Trial in_mm = t;
  in_mm.markers->position *= 1000;
  write_preview(in_mm, folder_ / "preview.html");
  page = files::read_whole(folder_ / "preview.html");
  EXPECT_GE(count("<li>markers.csv: "), 1u);
  EXPECT_NE(page.find("Not to be believed"), std::string::npos);
  EXPECT_NE(hanging_pictures(in_mm).at(0), hanging_pictures(t).at(0));
  in_mm.markers.reset();
  EXPECT_EQ(hanging_pictures(in_mm), std::vector<std::string>());
  EXPECT_THROW(import_recording(folder_ / "map.toml", folder_), BadInput);  // is there already
  files::write_whole(folder_ / "bad.toml", mapping + "colour = 1\n");
  EXPECT_THROW(import_recording(folder_ / "bad.toml", folder_ / "other"), BadInput);
  files::write_whole(folder_ / "left.toml", std::string(mapping).replace(mapping.find("\"-z\""), 4, "\"z\""));
  EXPECT_THROW(import_recording(folder_ / "left.toml", folder_ / "other"), BadInput);
  EXPECT_FALSE(fs::exists(folder_ / "other" / "theirs"));
}

TEST_F(Exchange, ImportsAFolderOfPictures) {
  fs::create_directories(folder_ / "pictures");
  for (int i = 0; i < 3; ++i)
    cv::imwrite((folder_ / "pictures" / fmt::format("p{}.png", i)).string(),
                cv::Mat(12, 20, CV_8UC3, cv::Scalar(40 * i, 40 * i, 40 * i)));
  files::write_whole(folder_ / "corners.csv", "s,a,b,c,d,e,f\n0,0,0,0,0.3,0,0\n0.1,0,0,0,0.3,0.01,0\n");
  files::write_whole(
      folder_ / "map.toml",
      "[trial]\nname = \"theirs\"\nkind = \"waving\"\n[fabric]\nname = \"x\"\nwidth_m = 0.3\nheight_m = 0.3\nmass_kg = "
      "0.02\n"
      "[corners]\nfile = \"corners.csv\"\ntime = \"s\"\nleft = [\"a\", \"b\", \"c\"]\nright = [\"d\", \"e\", "
      "\"f\"]\n[images]\nfolder = \"pictures\"\nrate_hz = 20\n"
      "[camera]\nwidth_px = 20\nheight_px = 12\nprojection = [100, 0, 10, 0, 0, 100, 6, 0, 0, 0, 1, 1]\n");
  const trial::Trial t = trial::read_trial(import_recording(folder_ / "map.toml", folder_));
  ASSERT_EQ(t.frames->time_s, (std::vector<double>{0, 0.05, 0.1}));
  EXPECT_EQ(trial::read_frame(t, 2)(5, 5), 80);
}

}  // namespace
}  // namespace selvedge::station
