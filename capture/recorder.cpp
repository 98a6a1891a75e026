#include "capture/recorder.h"

#include <chrono>
#include <cmath>
#include <stdexcept>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include "capture/trial/checked_trial.h"
#include "capture/trial/trial_writer.h"
#include "files/bad_input.h"
#include "files/checked_lines.h"
#include "files/csv_table.h"
#include "files/durable.h"
#include "files/whole_file.h"

namespace selvedge::capture {

namespace fs = std::filesystem;

namespace {

// Room for the final trial.json on a disk that has filled up meanwhile.
constexpr const char* reserve_name = ".reserve";
constexpr size_t reserve_bytes = 64 * 1024;

void append_point(std::string& row, const Eigen::Vector3d& point) {
  for (int axis = 0; axis < 3; ++axis) {
    row += ',';
    if (!point.hasNaN()) files::append_number(row, point(axis));
  }
}

void require_empty(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder, error)) return;
  if (!fs::is_directory(folder, error) || !fs::is_empty(folder, error))
    refuse(folder.string(), "found a folder that is not empty, expected a new one for the trial");
}

void require_finite(double time_s, const char* what) {
  if (!std::isfinite(time_s))
    throw std::invalid_argument(fmt::format("Recorder: {} at time {}, expected a finite time", what, time_s));
}

}  // namespace

Recorder::Recorder(const trial::Trial& header, const fs::path& folder, const RecorderOptions& options,
                   const nlohmann::json& extra)
    : folder_(folder), options_(options), trial_json_(trial::trial_to_json(header)) {
  if (header.camera) {
    width_px_ = header.camera->width_px;
    height_px_ = header.camera->height_px;
  }
  trial_json_["state"] = to_text(trial::State::recording);
  trial_json_.update(extra);
  require_empty(folder);
  files::make_folders(folder);
  folder_descriptor_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder_descriptor_ < 0 || ::flock(folder_descriptor_, LOCK_EX | LOCK_NB) != 0)
    throw std::runtime_error(folder.string() + ": cannot be opened and locked for recording");
  files::write_whole(folder / reserve_name, std::string(reserve_bytes, '\0'));
  trial::write_checked_json(folder, trial_json_);
  frames_ = std::make_unique<FrameWriter>(folder, options.frames);
  if (options.sync_interval_s > 0) syncer_ = std::thread([this] { sync_now_and_then(); });
}

Recorder::~Recorder() {
  try {
    if (!finished_) finish("the recorder was given up before the trial was finished");
  } catch (const std::exception&) {
    // The trial stays marked as being recorded, which `recover` mends.
  }
  stop_syncing();
  frames_.reset();
  ::close(folder_descriptor_);
}

bool Recorder::add_frame(int number, double time_s, const unsigned char* pixels, int width_px, int height_px) {
  require_finite(time_s, "a frame");
  if (width_px != width_px_ || height_px != height_px_ || number < 0)
    throw std::invalid_argument(
        fmt::format("Recorder: frame {} of {}x{} px, expected a number of 0 or more and {}x{} px", number, width_px,
                    height_px, width_px_, height_px_));
  {
    const std::lock_guard lock(mutex_);
    if (finished_ || !failure_.empty()) return false;
    if (last_number_ >= 0 && (number <= last_number_ || time_s < last_frame_s_)) {
      ++out_of_order_;
      return false;
    }
  }
  if (!frames_->add(number, time_s, pixels, width_px, height_px)) return false;
  const std::lock_guard lock(mutex_);
  if (last_number_ >= 0 && number > last_number_ + 1) gaps_.push_back({last_number_ + 1, number - 1});
  last_number_ = number;
  last_frame_s_ = time_s;
  return true;
}

bool Recorder::add_corners(double time_s, const Eigen::Vector3d& left, const Eigen::Vector3d& right) {
  std::string row;
  append_point(row, left);
  append_point(row, right);
  return append(corners_, "corners.csv", time_s, row);
}

bool Recorder::add_marker(double time_s, int marker, const Eigen::Vector2d& uv_m, const Eigen::Vector3d& position) {
  if (position.hasNaN()) return false;  // a hidden dot has no row
  std::string row = ',' + std::to_string(marker) + ',';
  files::append_number(row, uv_m.x());
  row += ',';
  files::append_number(row, uv_m.y());
  append_point(row, position);
  return append(markers_, "markers.csv", time_s, row);
}

bool Recorder::add_robot(double time_s, const Eigen::Vector3d& commanded, const Eigen::Vector3d& measured) {
  if (commanded.hasNaN() || measured.hasNaN())
    throw std::invalid_argument("Recorder: an arm sample that is not finite");
  std::string row;
  append_point(row, commanded);
  append_point(row, measured);
  return append(robot_, "robot.csv", time_s, row);
}

bool Recorder::append(Table& table, const char* name, double time_s, const std::string& row) {
  require_finite(time_s, name);
  std::string text;
  files::append_number(text, time_s);
  text = files::with_checksum(text + row);
  const std::lock_guard lock(mutex_);
  if (finished_ || !failure_.empty()) return false;
  if (table.rows.written > 0 && time_s < table.last_time_s) {
    ++out_of_order_;
    return false;
  }
  try {
    if (!table.file) table.file = std::make_unique<files::AppendFile>(folder_ / name, trial::checked_header(name));
    table.file->append(text);
  } catch (const std::runtime_error& error) {
    failure_ = error.what();
    return false;
  }
  table.last_time_s = time_s;
  ++table.rows.written;
  return true;
}

Recorded Recorder::recorded() const {
  const std::lock_guard lock(mutex_);
  Recorded now{frames_->counts(), corners_.rows, markers_.rows, robot_.rows, out_of_order_};
  now.frames.durable = durable_frames_;
  return now;
}

std::string Recorder::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_.empty() ? frames_->failure() : failure_;
}

trial::State Recorder::finish(const std::string& cut_because, const nlohmann::json& extra) {
  {
    const std::lock_guard lock(mutex_);
    if (finished_) throw std::logic_error("Recorder: finish was called twice");
    finished_ = true;
  }
  frames_->drain();
  stop_syncing();
  make_durable();
  const std::string disk = failure();
  const std::string why = disk.empty() ? cut_because : disk;
  const trial::State state = why.empty() ? trial::State::complete : trial::State::cut;
  const FrameCounts counts = frames_->counts();
  trial_json_.update(extra);
  trial_json_["state"] = to_text(state);
  trial_json_["frames"]["count"] = counts.written;
  trial_json_["frames"]["gaps"] = gaps_;
  trial_json_["frames"]["refused"] = counts.refused;
  trial_json_["rows"] = {{"corners.csv", corners_.rows.written},
                         {"frames.csv", counts.written},
                         {"markers.csv", markers_.rows.written},
                         {"robot.csv", robot_.rows.written}};
  if (!why.empty()) trial_json_["cut_because"] = why;
  fs::remove(folder_ / reserve_name);
  trial::write_checked_json(folder_, trial_json_);
  return state;
}

void Recorder::sync_now_and_then() {
  std::unique_lock lock(mutex_);
  const auto interval = std::chrono::duration<double>(options_.sync_interval_s);
  while (!ended_.wait_for(lock, interval, [this] { return ending_; })) {
    lock.unlock();
    if (!make_durable()) return;
    lock.lock();
  }
}

// One batch. What was written before the sync began is durable once it has ended; what came meanwhile waits for the
// next.
bool Recorder::make_durable() {
  const Recorded before = recorded();
  {
    const std::lock_guard lock(mutex_);
    if (sync_failed_) return false;
  }
  try {
    files::sync_file_system(folder_descriptor_, folder_);
  } catch (const std::runtime_error& error) {
    const std::lock_guard lock(mutex_);
    sync_failed_ = true;
    if (failure_.empty()) failure_ = error.what();
    return false;
  }
  const std::lock_guard lock(mutex_);
  corners_.rows.durable = before.corners.written;
  markers_.rows.durable = before.markers.written;
  robot_.rows.durable = before.robot.written;
  durable_frames_ = before.frames.written;
  return true;
}

void Recorder::stop_syncing() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ended_.notify_all();
  if (syncer_.joinable()) syncer_.join();
}

}  // namespace selvedge::capture
