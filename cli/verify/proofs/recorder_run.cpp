#include "cli/verify/proofs/recorder_run.h"

#include <chrono>
#include <cmath>
#include <random>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>
#include <unistd.h>

#include "capture/recorder.h"
#include "capture/recovery.h"
#include "files/append_file.h"
#include "files/whole_file.h"

namespace selvedge::cli {

namespace fs = std::filesystem;

namespace {

constexpr int kWidth_px = 48, kHeight_px = 32;

// Every sample and every picture has its number in it, so that one in another's place shows.
double time_s(size_t i) { return static_cast<double>(i) / 64; }
Eigen::Vector3d point(size_t i, double which) { return {which + 0.1 * static_cast<double>(i), 1.0 / 3, -which}; }

trial::GreyImage picture(int number) {
  std::mt19937 random(static_cast<unsigned>(number));
  return trial::GreyImage::NullaryExpr(kHeight_px, kWidth_px,
                                       [&] { return static_cast<unsigned char>(random() & 255); });
}

trial::Trial header() {
  trial::Trial header;
  header.experiment = trial::Experiment::robot;
  header.fabric = {"proof", 0.3, 0.3, 0.0144, true};
  header.camera.emplace();
  header.camera->matrix << 500, 0, 24, 0, 0, 500, 16, 0, 0, 0, 1, 1;
  header.camera->width_px = kWidth_px;
  header.camera->height_px = kHeight_px;
  return header;
}

// A journal as the station keeps one (files/append_file.h), in the folder that holds the trial.
fs::path journal_beside(const fs::path& trial) { return trial.parent_path() / "journal.txt"; }
std::string journal_line(size_t i) { return fmt::format("line {}\n", i); }

std::string wrong_journal(const fs::path& trial, uint64_t called_durable) {
  const fs::path path = journal_beside(trial);
  const std::string text = fs::exists(path) ? files::read_whole(path) : "";
  std::string wanted;
  for (size_t i = 0; i < called_durable; ++i) wanted += journal_line(i);
  return text.compare(0, wanted.size(), wanted) == 0
             ? ""
             : fmt::format("{} lines of the journal were called durable, and do not read", called_durable);
}

void say(const capture::Recorder& recorder, uint64_t journal, bool too_early, RecorderReport::State state) {
  const capture::Recorded now = recorder.recorded();
  const auto count = [&](const capture::RowCounts& rows) { return too_early ? rows.written : rows.durable; };
  const RecorderReport report{state,
                              count(now.corners),
                              count(now.markers),
                              count(now.robot),
                              too_early ? now.frames.written : now.frames.durable,
                              now.corners.written,
                              now.frames.written,
                              journal};
  if (::write(1, &report, sizeof report) != sizeof report) ::_exit(1);
}

std::string rows_short(const char* what, size_t read, uint64_t called_durable) {
  return read >= called_durable ? "" : fmt::format("{} {} read, {} were called durable", read, what, called_durable);
}

// Whatever reads is what was written, in its order, and what was called durable is among it without a gap.
template <class Matches>
std::string wrong_row(const char* what, const std::vector<double>& times_s, uint64_t called_durable, Matches matches) {
  for (size_t row = 0; row < times_s.size(); ++row) {
    const auto i = static_cast<size_t>(std::lround(64 * times_s[row]));
    if (i != row && row < called_durable)
      return fmt::format("{} {} is missing, {} were called durable", what, row, called_durable);
    if (times_s[row] != time_s(i) || !matches(row, i)) return fmt::format("{} {} is not what was written", what, row);
  }
  return rows_short(what, times_s.size(), called_durable);
}

std::string wrong_frame(const trial::Trial& found, uint64_t called_durable) {
  if (!found.frames) return rows_short("frames", 0, called_durable);
  return wrong_row("frame", found.frames->time_s, called_durable, [&](size_t row, size_t i) {
    return found.frames->number[row] == static_cast<int>(i) &&
           trial::read_frame(found, row) == picture(static_cast<int>(i));
  });
}

std::string compare(const trial::Trial& found, const RecorderReport& report) {
  const auto column = [](const Eigen::Matrix3Xd& points, size_t row) {
    return Eigen::Vector3d(points.col(static_cast<Eigen::Index>(row)));
  };
  std::string wrong = wrong_row("corner sample", found.corners.time_s, report.corners, [&](size_t row, size_t i) {
    return column(found.corners.left, row) == point(i, 0) && column(found.corners.right, row) == point(i, 1);
  });
  if (wrong.empty())
    wrong = !found.markers
                ? rows_short("marker samples", 0, report.markers)
                : wrong_row("marker sample", found.markers->time_s, report.markers,
                            [&](size_t row, size_t i) { return column(found.markers->position, row) == point(i, 2); });
  if (wrong.empty())
    wrong = !found.robot ? rows_short("arm samples", 0, report.robot)
                         : wrong_row("arm sample", found.robot->time_s, report.robot, [&](size_t row, size_t i) {
                             return column(found.robot->measured, row) == point(i, 4);
                           });
  if (wrong.empty()) wrong = wrong_frame(found, report.frames);
  if (wrong.empty() && report.state == RecorderReport::complete &&
      (found.state != trial::State::complete || !found.damaged.empty()))
    wrong = "the trial was called complete and is not";
  return wrong;
}

}  // namespace

void record_job(const RecorderJob& job) {
  capture::RecorderOptions options;
  options.sync_interval_s = 0.002;
  capture::Recorder recorder(header(), job.trial, options);
  say(recorder, 0, job.too_early, RecorderReport::recording);
  files::AppendFile journal(journal_beside(job.trial), journal_line(0));
  uint64_t lines = 0;
  for (int i = 0; i < job.rows; ++i) {
    if (i % 8 == 3) {
      if (lines > 0) journal.append(journal_line(lines));
      journal.sync();
      ++lines;
    }
    const auto n = static_cast<size_t>(i);
    recorder.add_corners(time_s(n), point(n, 0), point(n, 1));
    recorder.add_marker(time_s(n), 3, {0.1, 0.2}, point(n, 2));
    recorder.add_robot(time_s(n), point(n, 3), point(n, 4));
    const trial::GreyImage pixels = picture(i);
    recorder.add_frame(i, time_s(n), pixels.data(), kWidth_px, kHeight_px);
    say(recorder, lines, job.too_early, RecorderReport::recording);
    std::this_thread::sleep_for(std::chrono::microseconds(300));
    say(recorder, lines, job.too_early, RecorderReport::recording);
  }
  const trial::State state = recorder.finish();
  say(recorder, lines, job.too_early, state == trial::State::complete ? RecorderReport::complete : RecorderReport::cut);
}

std::string shortfall(const fs::path& trial, const RecorderReport& report, bool began) {
  try {
    const std::string wrong = compare(capture::recover(trial).trial, report);
    return wrong.empty() ? wrong_journal(trial, report.journal) : wrong;
  } catch (const std::exception& error) {
    // Before the recorder was there, nobody was told that there is a trial.
    return began ? error.what() : "";
  }
}

}  // namespace selvedge::cli
