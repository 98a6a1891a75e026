#include "capture/frame_writer.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "capture/trial/checked_trial.h"
#include "capture/trial/grey_png.h"
#include "capture/trial/trial_writer.h"
#include "files/checked_lines.h"
#include "files/csv_table.h"

namespace selvedge::capture {

namespace {

// Written, not yet durable: the recorder syncs the whole file system, a batch of frames at a time.
void write_file(const std::filesystem::path& path, const std::string& bytes) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  int number = descriptor < 0 ? errno : 0;
  for (size_t written = 0; number == 0 && written < bytes.size();) {
    const ssize_t count = ::write(descriptor, bytes.data() + written, bytes.size() - written);
    if (count >= 0) written += static_cast<size_t>(count);
    else if (errno != EINTR) number = errno;
  }
  if (descriptor >= 0) ::close(descriptor);
  if (number == 0) return;
  ::unlink(path.c_str());
  throw std::runtime_error(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(number)));
}

}  // namespace

FrameWriter::FrameWriter(std::filesystem::path trial_folder, const FrameWriterOptions& options)
    : folder_(std::move(trial_folder)), options_(options) {
  for (int i = 0; i < std::max(1, options.workers); ++i) workers_.emplace_back([this] { work(); });
}

FrameWriter::~FrameWriter() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    queue_.clear();
  }
  changed_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

bool FrameWriter::add(int number, double time_s, const unsigned char* pixels, int width_px, int height_px) {
  const size_t size = static_cast<size_t>(width_px) * height_px;
  std::unique_lock lock(mutex_);
  // A single frame larger than the whole queue still goes in, alone.
  const auto has_room = [&] {
    return !failure_.empty() || queued_bytes_ == 0 || queued_bytes_ + size <= options_.queue_bytes;
  };
  const bool in_time = changed_.wait_for(lock, std::chrono::duration<double>(options_.patience_s), has_room);
  if (!in_time || !failure_.empty()) {
    ++counts_.refused;
    return false;
  }
  Job job{next_sequence_++,
          number,
          time_s,
          width_px,
          height_px,
          4 * queued_bytes_ > options_.queue_bytes,
          std::vector<unsigned char>(pixels, pixels + size)};
  queue_.push_back(std::move(job));
  queued_bytes_ += size;
  counts_.most_queued_bytes = std::max(counts_.most_queued_bytes, queued_bytes_);
  ++counts_.accepted;
  lock.unlock();
  changed_.notify_all();
  return true;
}

void FrameWriter::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return !failure_.empty() || counts_.written == counts_.accepted; });
}

FrameCounts FrameWriter::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

std::string FrameWriter::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void FrameWriter::work() {
  while (true) {
    Job job;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return ending_ || !queue_.empty(); });
      if (queue_.empty()) return;
      job = std::move(queue_.front());
      queue_.pop_front();
    }
    try {
      write(job);
    } catch (const std::exception& error) { fail(error.what()); }
  }
}

void FrameWriter::write(const Job& job) {
  const std::string png =
      trial::encode_grey_png(job.pixels.data(), job.width_px, job.height_px, job.stored ? 0 : options_.level);
  std::filesystem::create_directory(folder_ / "frames");  // does nothing where it is there
  write_file(trial::frame_path(folder_, job.number), png);
  list(job, png);
}

void FrameWriter::list(const Job& job, const std::string& png) {
  std::string row = std::to_string(job.number) + ',';
  files::append_number(row, job.time_s);
  row = files::with_checksum(row + ',' + std::to_string(files::crc32_of(png)));
  {
    const std::lock_guard lock(mutex_);
    queued_bytes_ -= job.pixels.size();
    if (!failure_.empty()) return;
    counts_.stored += job.stored;
    counts_.bytes_on_disk += png.size();
    finished_.emplace(job.sequence, row);
    if (!csv_) csv_ = std::make_unique<files::AppendFile>(folder_ / "frames.csv", trial::checked_header("frames.csv"));
    while (!finished_.empty() && finished_.begin()->first == next_listed_) {
      csv_->append(finished_.begin()->second);
      finished_.erase(finished_.begin());
      ++next_listed_;
      ++counts_.written;
    }
  }
  changed_.notify_all();
}

void FrameWriter::fail(const std::string& why) {
  {
    const std::lock_guard lock(mutex_);
    if (failure_.empty()) failure_ = why;
    for (const Job& job : queue_) queued_bytes_ -= job.pixels.size();
    queue_.clear();
  }
  changed_.notify_all();
}

}  // namespace selvedge::capture
