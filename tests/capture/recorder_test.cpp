#include "capture/recorder.h"

#include <cmath>
#include <csignal>
#include <random>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "capture/recovery.h"
#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::capture {
namespace {

namespace fs = std::filesystem;

constexpr int width = 64, height = 48;

trial::Trial header() {
  trial::Trial header;
  header.experiment = trial::Experiment::waving;
  header.fabric = {"test fabric", 0.3, 0.3, 0.0144, true};
  geometry::Projection camera;
  camera.matrix << 500, 0, 32, 0, 0, 500, 24, 0, 0, 0, 1, 1;
  camera.width_px = width;
  camera.height_px = height;
  header.camera = camera;
  return header;
}

// Every frame has its number in it, so that a mixed-up file shows.
trial::GreyImage image(int number) {
  std::mt19937 random(static_cast<unsigned>(number));
  return trial::GreyImage::NullaryExpr(height, width, [&] { return static_cast<unsigned char>(random() & 255); });
}

bool add_image(Recorder& recorder, int number) {
  const trial::GreyImage pixels = image(number);
  return recorder.add_frame(number, number / 60.0, pixels.data(), width, height);
}

void add_corner_sample(Recorder& recorder, int i) {
  const Eigen::Vector3d left(0.1 * i, 1.0 / 3, -0.25), hidden = Eigen::Vector3d::Constant(std::nan(""));
  recorder.add_corners(i / 120.0, left, i % 5 == 2 ? hidden : Eigen::Vector3d(left.array() + 0.3));
}

class RecorderTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "selvedge-recorder-XXXXXX";
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    scratch_ = name;
    folder_ = scratch_ / "trial";
  }
  void TearDown() override { fs::remove_all(scratch_); }

  // Every listed frame is there with its own pixels.
  void expect_frames(const trial::Trial& trial, size_t at_least) {
    ASSERT_TRUE(trial.frames);
    EXPECT_GE(trial.frames->number.size(), at_least);
    for (size_t i = 0; i < trial.frames->number.size(); ++i) {
      EXPECT_EQ(read_frame(trial, i), image(trial.frames->number[i]));
      EXPECT_EQ(trial.frames->time_s[i], trial.frames->number[i] / 60.0);
    }
  }

  fs::path scratch_, folder_;
};

TEST_F(RecorderTest, RecordsATrialThatReadsBackWhole) {
  Recorder recorder(header(), folder_, {}, {{"clocks", {{"offset_s", 5.25}}}});
  for (int i = 0; i < 40; ++i) add_corner_sample(recorder, i);
  for (int number : {3, 4, 5, 8, 9, 20}) EXPECT_TRUE(add_image(recorder, number));
  EXPECT_TRUE(recorder.add_marker(0.5, 7, {0.1, 0.2}, {1, 2, 3}));
  EXPECT_TRUE(recorder.add_robot(0.25, {1, 2, 3}, {1, 2, 3.5}));
  EXPECT_EQ(recorder.finish("", {{"drift_ppm", 50}}), trial::State::complete);

  const trial::Trial trial = trial::read_trial(folder_);
  EXPECT_EQ(trial.state, trial::State::complete);
  EXPECT_EQ(trial.corners.time_s.size(), 40u);
  EXPECT_EQ(trial.corners.left(0, 39), 0.1 * 39);
  EXPECT_TRUE(std::isnan(trial.corners.right(1, 2)));
  EXPECT_EQ(trial.markers->marker[0], 7);
  EXPECT_EQ(trial.robot->measured(2, 0), 3.5);
  expect_frames(trial, 6);
  const nlohmann::json json = files::read_json(folder_ / "trial.json");
  EXPECT_EQ(json["frames"]["gaps"], (nlohmann::json{{6, 7}, {10, 19}}));
  EXPECT_EQ(json["frames"]["count"], 6);
  EXPECT_EQ(json["clocks"]["offset_s"], 5.25);
  EXPECT_EQ(json["drift_ppm"], 50);
  for (const auto& entry : fs::directory_iterator(folder_)) EXPECT_NE(entry.path().filename().string()[0], '.');
}

TEST_F(RecorderTest, KeepsOrderWithManyWorkersAndBoundsItsMemory) {
  RecorderOptions options;
  options.frames.workers = 4;
  options.frames.queue_bytes = 5 * width * height;
  options.frames.patience_s = 60;
  Recorder recorder(header(), folder_, options);
  add_corner_sample(recorder, 0);
  for (int number = 0; number < 300; ++number) ASSERT_TRUE(add_image(recorder, number));
  recorder.finish();
  EXPECT_LE(recorder.recorded().frames.most_queued_bytes, 5u * width * height);
  EXPECT_GT(recorder.recorded().frames.stored, 0u);
  const trial::Trial trial = trial::read_trial(folder_);
  expect_frames(trial, 300);
}

TEST_F(RecorderTest, FramesThatFindNoRoomAreRefusedAndNamedAsGaps) {
  RecorderOptions options;
  options.frames.workers = 1;
  options.frames.queue_bytes = width * height;
  options.frames.patience_s = 0;
  Recorder recorder(header(), folder_, options);
  add_corner_sample(recorder, 0);
  std::vector<int> kept;
  for (int number = 0; number < 2000; ++number)
    if (add_image(recorder, number)) kept.push_back(number);
  recorder.finish();
  const Recorded recorded = recorder.recorded();
  EXPECT_EQ(recorded.frames.written, kept.size());
  EXPECT_EQ(recorded.frames.refused, 2000 - kept.size());
  EXPECT_EQ(trial::read_trial(folder_).frames->number, kept);
  EXPECT_EQ(files::read_json(folder_ / "trial.json")["frames"]["gaps"], number_gaps(kept));
}

TEST_F(RecorderTest, WhatGoesBackInTimeIsNotKeptButCounted) {
  Recorder recorder(header(), folder_);
  add_corner_sample(recorder, 5);
  EXPECT_FALSE(recorder.add_corners(0, {0, 0, 0}, {0, 0, 0}));
  EXPECT_TRUE(add_image(recorder, 5));
  EXPECT_FALSE(add_image(recorder, 5));
  EXPECT_FALSE(add_image(recorder, 4));
  recorder.finish();
  EXPECT_EQ(recorder.recorded().out_of_order, 3u);
  expect_frames(trial::read_trial(folder_), 1);
}

TEST_F(RecorderTest, RefusesWrongSizesAndFoldersInUse) {
  Recorder recorder(header(), folder_);
  const trial::GreyImage pixels = image(1);
  EXPECT_THROW(recorder.add_frame(0, 0, pixels.data(), width - 1, height), std::invalid_argument);
  EXPECT_THROW(recorder.add_frame(0, std::nan(""), pixels.data(), width, height), std::invalid_argument);
  EXPECT_THROW(Recorder(header(), folder_), BadInput);
  EXPECT_THROW(recover(folder_), BadInput);  // still being recorded
}

TEST_F(RecorderTest, GivenUpWithoutFinishIsCut) {
  {
    Recorder recorder(header(), folder_);
    add_corner_sample(recorder, 0);
    add_image(recorder, 0);
  }
  const trial::Trial trial = trial::read_trial(folder_);
  EXPECT_EQ(trial.state, trial::State::cut);
  expect_frames(trial, 1);
  EXPECT_FALSE(recover(folder_).mended);
}

// Runs `record` in a process of its own, which may report numbers through the pipe it is given.
pid_t start_child(int report, const std::function<void(int)>& record) {
  const pid_t child = ::fork();
  if (child == 0) {
    record(report);
    ::_exit(0);
  }
  return child;
}

TEST_F(RecorderTest, WhatWasWrittenIsReadableAfterKill9) {
  std::mt19937 random(3);
  for (int round = 0; round < 6; ++round) {
    folder_ = scratch_ / std::to_string(round);
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = start_child(ends[1], [&](int report) {
      RecorderOptions options;
      options.sync_interval_s = 0;
      Recorder recorder(header(), folder_, options);
      for (int i = 0;; ++i) {
        add_corner_sample(recorder, i);
        add_image(recorder, i);
        const Recorded recorded = recorder.recorded();
        const size_t written[2] = {recorded.corners.written, recorded.frames.written};
        if (::write(report, written, sizeof written) < 0) return;
      }
    });
    size_t written[2] = {0, 0};
    const int reports = 30 + static_cast<int>(random() % 200);
    for (int i = 0; i < reports; ++i)
      ASSERT_EQ(::read(ends[0], written, sizeof written), static_cast<ssize_t>(sizeof written));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    ::close(ends[0]);
    ::close(ends[1]);

    const trial::Trial found = trial::read_trial(folder_);
    EXPECT_EQ(found.state, trial::State::recording);
    EXPECT_GE(found.corners.time_s.size(), written[0]);
    // On a busy machine no picture may have been written yet.
    if (written[1] > 0 || found.frames) expect_frames(found, written[1]);
    EXPECT_TRUE(recover(folder_).mended);
    const trial::Trial mended = trial::read_trial(folder_);
    EXPECT_EQ(mended.state, trial::State::cut);
    ASSERT_EQ(mended.frames.has_value(), found.frames.has_value());
    if (found.frames) { EXPECT_EQ(mended.frames->number, found.frames->number); }
    EXPECT_EQ(mended.corners.time_s, found.corners.time_s);
  }
}

// The recorder may be killed before the first picture, or between a table's birth and its first row.
TEST_F(RecorderTest, WhatATrialThatWasCutLacksDoesNotHideTheRest) {
  {
    Recorder recorder(header(), folder_);
    for (int i = 0; i < 3; ++i) add_corner_sample(recorder, i);
  }
  EXPECT_EQ(trial::read_trial(folder_).corners.time_s.size(), 3u);
  fs::create_directory(folder_ / "frames");
  for (const char* begun : {"", "t_s,fra", "t_s,frame\n", "t_s,frame\n0.1"}) {
    files::write_whole(folder_ / "frames.csv", begun);
    files::write_whole(folder_ / "markers.csv", begun);
    files::write_whole(folder_ / "robot.csv", begun);
    const trial::Trial found = trial::read_trial(folder_);
    EXPECT_EQ(found.corners.time_s.size(), 3u);
    EXPECT_FALSE(found.frames || found.markers || found.robot);
  }
  nlohmann::json json = files::read_json(folder_ / "trial.json");
  json["state"] = "complete";
  files::write_json(folder_ / "trial.json", json);
  EXPECT_EQ(trial::read_trial(folder_).damaged.size(),
            4u);  // three tables, and trial.json that is not as it was written
}

TEST_F(RecorderTest, FramesReadBackWhereNoCornerWasEverSeen) {
  for (const bool hidden : {false, true}) {
    fs::remove_all(folder_);
    {
      Recorder recorder(header(), folder_);
      const Eigen::Vector3d nowhere = Eigen::Vector3d::Constant(std::nan(""));
      if (hidden) recorder.add_corners(0, nowhere, nowhere);
      ASSERT_TRUE(add_image(recorder, 0));
      recorder.finish("the tracker fell silent");
    }
    const trial::Trial found = trial::read_trial(folder_);
    EXPECT_EQ(found.corners.time_s.size(), hidden ? 1u : 0u);
    expect_frames(found, 1);
  }
}

TEST_F(RecorderTest, AFullDiskCutsTheTrialAndKeepsWhatIsThere) {
  // A limit on file size stands for the full disk: the write that passes it fails half way through a line.
  const pid_t child = start_child(-1, [&](int) {
    std::signal(SIGXFSZ, SIG_IGN);
    Recorder recorder(header(), folder_);
    const rlimit limit{10000, 10000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    int kept = 0;
    for (int i = 0; i < 1000 && recorder.failure().empty(); ++i) {
      add_corner_sample(recorder, i);
      if (i % 20 == 0) kept += add_image(recorder, i / 20);
    }
    const bool failed = !recorder.failure().empty() && !add_image(recorder, 5000);
    const bool is_cut = recorder.finish() == trial::State::cut;
    ::_exit(failed && is_cut && kept > 0 ? 0 : 1);
  });
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  const trial::Trial trial = trial::read_trial(folder_);
  EXPECT_EQ(trial.state, trial::State::cut);
  EXPECT_GT(trial.corners.time_s.size(), 50u);
  expect_frames(trial, 1);
  const nlohmann::json json = files::read_json(folder_ / "trial.json");
  EXPECT_NE(json["cut_because"].get<std::string>().find("corners.csv"), std::string::npos);
  EXPECT_EQ(files::read_whole(folder_ / "corners.csv").back(), '\n');
}

}  // namespace
}  // namespace selvedge::capture
