// Damage to any file of a recorded trial: the rest reads, what is damaged is named, and nothing crashes.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "capture/recorder.h"
#include "capture/recovery.h"
#include "capture/trial/checked_trial.h"
#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::capture {
namespace {

namespace fs = std::filesystem;
using trial::Trial;

constexpr int wide = 48, high = 32, samples = 40, frames = 6;

Trial damaged_header() {
  Trial header;
  header.experiment = trial::Experiment::robot;
  header.fabric = {"test fabric", 0.3, 0.3, 0.0144, true};
  header.camera.emplace();
  header.camera->matrix << 500, 0, 24, 0, 0, 500, 16, 0, 0, 0, 1, 1;
  header.camera->width_px = wide;
  header.camera->height_px = high;
  return header;
}

void add_samples(Recorder& recorder, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const auto point = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  for (int i = 0; i < samples; ++i) {
    recorder.add_corners(i / 120.0, point(), i % 7 == 3 ? Eigen::Vector3d::Constant(std::nan("")).eval() : point());
    recorder.add_marker(i / 120.0, 3, {0.1, 0.2}, point());
    recorder.add_robot(i / 120.0, point(), point());
  }
  for (int number = 0; number < frames; ++number) {
    const trial::GreyImage pixels =
        trial::GreyImage::NullaryExpr(high, wide, [&] { return static_cast<unsigned char>(random() & 255); });
    recorder.add_frame(number, number / 60.0, pixels.data(), wide, high);
  }
}

class DamagedRecording : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "selvedge-damaged-XXXXXX";
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    scratch_ = name;
    std::mt19937 random(11);
    Recorder recorder(damaged_header(), sound());
    add_samples(recorder, random);
    ASSERT_EQ(recorder.finish(), trial::State::complete);
    whole_ = trial::read_trial(sound());
    ASSERT_TRUE(whole_.damaged.empty());
  }
  void TearDown() override { fs::remove_all(scratch_); }

  fs::path sound() const { return scratch_ / "sound"; }
  fs::path copy() const { return scratch_ / "trial"; }

  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(sound()))
      if (entry.is_regular_file()) names.push_back(fs::relative(entry.path(), sound()).string());
    std::sort(names.begin(), names.end());
    return names;
  }

  void make_copy() const {
    fs::remove_all(copy());
    fs::copy(sound(), copy(), fs::copy_options::recursive);
  }

  fs::path scratch_;
  Trial whole_;
};

// Every row that reads is one of the whole trial's, at its time; returns how many do not.
template <class Same>
size_t rows_lost(const std::vector<double>& found, const std::vector<double>& whole, Same same) {
  for (size_t row = 0; row < found.size(); ++row) {
    const auto at = std::find(whole.begin(), whole.end(), found[row]);
    const bool there = at != whole.end() && same(row, static_cast<size_t>(at - whole.begin()));
    EXPECT_TRUE(there) << "row " << row;
  }
  return whole.size() - found.size();
}

bool same(const Eigen::Matrix3Xd& a, size_t i, const Eigen::Matrix3Xd& b, size_t j) {
  const Eigen::Vector3d p = a.col(static_cast<Eigen::Index>(i)), q = b.col(static_cast<Eigen::Index>(j));
  return p == q || (p.hasNaN() && q.hasNaN());
}

struct Lost {
  size_t corners = 0, markers = 0, robot = 0, frames = 0;
};

Lost lost_from(const Trial& whole, const Trial& found) {
  const trial::Markers no_markers;
  const trial::Robot no_arm;
  const trial::Frames no_frames;
  const trial::Markers& m = found.markers ? *found.markers : no_markers;
  const trial::Robot& r = found.robot ? *found.robot : no_arm;
  const trial::Frames& f = found.frames ? *found.frames : no_frames;
  Lost lost;
  lost.corners = rows_lost(found.corners.time_s, whole.corners.time_s, [&](size_t i, size_t j) {
    return same(found.corners.left, i, whole.corners.left, j) && same(found.corners.right, i, whole.corners.right, j);
  });
  lost.markers = rows_lost(m.time_s, whole.markers->time_s,
                           [&](size_t i, size_t j) { return same(m.position, i, whole.markers->position, j); });
  lost.robot = rows_lost(r.time_s, whole.robot->time_s,
                         [&](size_t i, size_t j) { return same(r.measured, i, whole.robot->measured, j); });
  lost.frames = rows_lost(f.time_s, whole.frames->time_s, [&](size_t i, size_t j) {
    return f.number[i] == whole.frames->number[j] && read_frame(found, i) == read_frame(whole, j);
  });
  return lost;
}

struct Damage {
  std::string name;
  std::function<void(std::string& bytes, std::mt19937& random)> apply;
  bool local = false;  // touches two lines of a table at most
};

const std::vector<Damage>& damages() {
  static const std::vector<Damage> list =
      {
          {"empty", [](std::string& bytes, std::mt19937&) { bytes.clear(); }},
          {"all zeros", [](std::string& bytes, std::mt19937&) { bytes.assign(bytes.size(), '\0'); }},
          {"cut", [](std::string& bytes, std::mt19937& random) { bytes.resize(random() % bytes.size()); }},
          {"cut by a byte", [](std::string& bytes, std::mt19937&) { bytes.pop_back(); }},
          {"zeros from somewhere on",
           [](std::string& bytes, std::mt19937& random) {
    const size_t from = random() % bytes.size();
    bytes.replace(from, std::string::npos, bytes.size() - from, '\0');
           }},
          {"sixteen zeros",
           [](std::string& bytes, std::mt19937& random) {
    const size_t from = random() % (bytes.size() - 16);
    bytes.replace(from, 16, 16, '\0');
           },
           true},
                                   {"a bit flipped",
                                    [](std::string& bytes, std::mt19937& random) {
    bytes[random() % bytes.size()] ^= static_cast<char>(1 << random() % 8);
                                    },
                                    true},
      {"bytes of another file",
       [](std::string& bytes, std::mt19937& random) {
    for (char& byte : bytes) byte = static_cast<char>(random());
       }},
      };
  return list;
}

bool names(const std::vector<std::string>& sentences, const std::string& file) {
  // Images one after another are named from the first to the last.
  return std::any_of(sentences.begin(), sentences.end(),
                     [&](const std::string& s) { return s.find(file) != std::string::npos; });
}

std::string text_of(const std::vector<std::string>& sentences) {
  std::string text;
  for (const std::string& s : sentences) text += s + "\n";
  return text;
}

// JSON without its last line break is no damage.
bool says_the_same(const std::string& a, const std::string& b) {
  return nlohmann::json::parse(a, nullptr, false) == nlohmann::json::parse(b);
}

// What may be lost of a trial where this one file is damaged.
void expect_rest(const Trial& whole, const Trial& found, const std::string& file, const Damage& damage) {
  const Lost lost = lost_from(whole, found);
  const size_t most = damage.local ? 2 : samples;
  EXPECT_LE(lost.corners, file == "corners.csv" ? most : 0);
  EXPECT_LE(lost.markers, file == "markers.csv" ? most : 0);
  EXPECT_LE(lost.robot, file == "robot.csv" ? most : 0);
  const bool image = file.rfind("frames/", 0) == 0;
  EXPECT_LE(lost.frames, image ? 1 : file == "frames.csv" ? most : 0);
  if (image) { EXPECT_EQ(lost.frames, 1u); }
  EXPECT_EQ(found.fabric.name, whole.fabric.name);
}

TEST_F(DamagedRecording, AnyFileDamagedAnywhereIsNamedAndTheRestReads) {
  std::mt19937 random(3);
  int refused = 0, read = 0;
  for (const std::string& file : files())
    for (const Damage& damage : damages())
      for (int place = 0; place < 8; ++place) {
        make_copy();
        const std::string before = files::read_whole(copy() / file);
        std::string bytes = before;
        damage.apply(bytes, random);
        if (bytes == before || (file.ends_with(".json") && says_the_same(bytes, before))) continue;
        SCOPED_TRACE(fmt::format("{}: {}, place {}", file, damage.name, place));
        files::write_whole(copy() / file, bytes);
        try {
          const Trial found = trial::read_trial(copy());
          EXPECT_TRUE(names(found.damaged, file)) << text_of(found.damaged);
          if (file != "trial.json") expect_rest(whole_, found, file, damage);
          ++read;
        } catch (const BadInput& error) {
          EXPECT_EQ(file, "trial.json") << error.what();
          EXPECT_NE(std::string(error.what()).find("trial.json"), std::string::npos) << error.what();
          EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
          ++refused;
          // From its copy the trial is had whole.
          const Recovery recovery = recover(copy());
          EXPECT_TRUE(recovery.mended);
          EXPECT_TRUE(recovery.trial.damaged.empty()) << text_of(recovery.trial.damaged);
          EXPECT_EQ(recovery.trial.state, trial::State::complete);
          expect_rest(whole_, recovery.trial, "", damage);
        }
        EXPECT_NO_THROW(recover(copy()));
      }
  EXPECT_GT(refused, 20);
  EXPECT_GT(read, 300);
}

TEST_F(DamagedRecording, BothCopiesOfTrialJsonGoneIsOneErrorThatSaysWhatIsLeft) {
  make_copy();
  files::write_whole(copy() / "trial.json", "{");
  files::write_whole(copy() / trial::copy_name, "");
  try {
    recover(copy());
    FAIL() << "not refused";
  } catch (const BadInput& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("trial.json"), std::string::npos) << text;
    EXPECT_NE(text.find(fmt::format("{} rows of corners.csv", samples)), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  }
}

// What a loss of power leaves of a trial that was being recorded.
TEST_F(DamagedRecording, AKilledTrialIsMendedToWhatReadsEverywhere) {
  make_copy();
  nlohmann::json about = files::read_json(copy() / "trial.json");
  about["state"] = "recording";
  about.erase("rows");
  trial::write_checked_json(copy(), about);
  files::write_whole(trial::frame_path(copy(), 4), "");
  std::string corners = files::read_whole(copy() / "corners.csv");
  const size_t at = corners.find("\n0.025,");
  ASSERT_NE(at, std::string::npos);
  corners.replace(at + 1, 10, 10, '\0');
  files::write_whole(copy() / "corners.csv", corners + std::string(300, '\0'));
  files::write_whole(trial::frame_path(copy(), 77), "never listed");

  const Recovery recovery = recover(copy());
  EXPECT_TRUE(recovery.mended);
  EXPECT_EQ(recovery.trial.state, trial::State::cut);
  EXPECT_EQ(recovery.trial.corners.time_s.size(), samples - 1u);
  EXPECT_EQ(recovery.trial.frames->number, (std::vector<int>{0, 1, 2, 3, 5}));
  EXPECT_TRUE(names(recovery.trial.damaged, "corners.csv: line 5 damaged")) << text_of(recovery.trial.damaged);
  EXPECT_TRUE(names(recovery.trial.damaged, "frames/000004.png: empty")) << text_of(recovery.trial.damaged);
  EXPECT_FALSE(fs::exists(trial::frame_path(copy(), 77)));
  EXPECT_EQ(files::read_json(copy() / "trial.json")["frames"]["gaps"], (nlohmann::json{{4, 4}}));
  // A reader that knows nothing of checksums reads it too, and what was damaged lies beside it.
  about = files::read_json(copy() / "trial.json");
  for (const char* key : {"checksums", "crc32", "damaged"}) about.erase(key);
  EXPECT_TRUE(fs::exists(copy() / "corners.csv.damaged"));
  files::write_json(copy() / "trial.json", about);
  EXPECT_EQ(trial::read_trial(copy()).corners.time_s.size(), samples - 1u);
  EXPECT_FALSE(recover(copy()).mended);
}

TEST_F(DamagedRecording, ATrialWithoutChecksumsReadsAsBefore) {
  make_copy();
  nlohmann::json about = files::read_json(copy() / "trial.json");
  for (const char* key : {"checksums", "crc32", "rows"}) about.erase(key);
  files::write_json(copy() / "trial.json", about);
  EXPECT_TRUE(trial::read_trial(copy()).damaged.empty());
  files::write_whole(trial::frame_path(copy(), 4), "");
  EXPECT_THROW(trial::read_trial(copy()), BadInput);
}

TEST_F(DamagedRecording, WhatIsNoTrialIsRefused) {
  EXPECT_THROW(recover(scratch_ / "nothing"), BadInput);
  fs::create_directory(scratch_ / "empty");
  EXPECT_THROW(recover(scratch_ / "empty"), BadInput);
  EXPECT_THROW(trials_at(scratch_ / "empty"), BadInput);
  EXPECT_EQ(trials_at(scratch_), std::vector<fs::path>{sound()});
}

}  // namespace
}  // namespace selvedge::capture
