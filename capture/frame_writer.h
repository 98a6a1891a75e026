// Writes frames as PNG files from several threads, with bounded memory, and lists each in frames.csv once
// its file is whole: in the order in which frames came, whichever thread was first. The recorder makes them durable.
//
// Compression gives way to speed: while the queue is short, zlib's `level`; as it fills, stored.
#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "files/append_file.h"

namespace selvedge::capture {

struct FrameWriterOptions {
  int workers = 2;
  size_t queue_bytes = size_t{256} << 20;  // most memory that waiting frames take
  int level = 1;                           // of zlib, 0 to 9
  double patience_s = 2;                   // how long `add` waits for room in the queue
};

struct FrameCounts {
  size_t accepted = 0;  // taken into the queue
  size_t written = 0;   // file whole and listed: readable whatever happens to this process
  size_t durable = 0;   // of those, on the disk: readable after a loss of power (set by the recorder)
  size_t refused = 0;   // queue full for longer than `patience_s`, or the disk failed
  size_t stored = 0;    // written without compression, to keep up
  size_t most_queued_bytes = 0;
  unsigned long long bytes_on_disk = 0;
};

class FrameWriter {
 public:
  FrameWriter(std::filesystem::path trial_folder, const FrameWriterOptions& options);
  ~FrameWriter();  // gives up what still waits

  // 8-bit grey, row major without padding; copied. False where it was refused.
  bool add(int number, double time_s, const unsigned char* pixels, int width_px, int height_px);

  // Waits until everything accepted is written, or the disk has failed.
  void drain();

  FrameCounts counts() const;
  // Empty, or why writing ended.
  std::string failure() const;

 private:
  struct Job {
    size_t sequence = 0;
    int number = 0;
    double time_s = 0;
    int width_px = 0, height_px = 0;
    bool stored = false;
    std::vector<unsigned char> pixels;
  };

  void work();
  void write(const Job& job);
  void list(const Job& job, const std::string& png);
  void fail(const std::string& why);

  const std::filesystem::path folder_;
  const FrameWriterOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> queue_;
  size_t queued_bytes_ = 0;  // waiting or being written
  size_t next_sequence_ = 0, next_listed_ = 0;
  std::map<size_t, std::string> finished_;  // rows that wait for an earlier frame
  std::unique_ptr<files::AppendFile> csv_;
  FrameCounts counts_;
  std::string failure_;
  bool ending_ = false;
  std::vector<std::thread> workers_;
};

}  // namespace selvedge::capture
