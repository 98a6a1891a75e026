// Records one trial straight into the exchange format. Two counts for what is kept (files/durable.h):
//   written: stays readable after kill -9 of this process or a full disk;
//   durable: stays readable after a loss of power as well. A thread of its own syncs, a batch at a time, so that
//   recording waits for no disk. Where a sync fails, the trial is cut: nothing more is kept, and nothing more is called
//   durable.
// Every line, every image and trial.json carry a checksum (capture/trial/checked_trial.h).
//
// Times are already those of the motion-capture clock. trial.json is there from the start with "state":
// "recording"; `finish` puts "complete" or "cut" in its place, atomically, with the number of frames and
// every gap in their numbers:
//   "frames": {"count", "gaps": [[first missing, last missing], …], "refused": frames not kept up with},
//   "rows": rows of each table,
//   "cut_because": why, where it is cut.
// Samples are appended as they come; frames go through a bounded queue (capture/frame_writer.h).
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "capture/frame_writer.h"
#include "capture/trial/trial.h"
#include "files/append_file.h"

namespace selvedge::capture {

struct RecorderOptions {
  FrameWriterOptions frames;
  double sync_interval_s = 1;  // pause between two syncs; 0: only at the end
};

struct RowCounts {
  size_t written = 0, durable = 0;
};

struct Recorded {
  FrameCounts frames;
  RowCounts corners, markers, robot;
  size_t out_of_order = 0;  // samples and frames whose time, or number, went backwards: not kept
};

class Recorder {
 public:
  // header: everything about the trial but its samples; its camera gives the frames' size.
  // extra: further keys for trial.json (how clocks were mapped, who recorded), beside the format's own.
  // folder: made here; must be absent or empty. Throws BadInput where it is not.
  Recorder(const trial::Trial& header, const std::filesystem::path& folder, const RecorderOptions& options = {},
           const nlohmann::json& extra = nlohmann::json::object());
  // Without `finish`: the trial is marked as cut.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // Each kind may come from a thread of its own. True: accepted; frames are written later (`recorded`), the others at
  // once. False: not kept, and counted. A wrong image size or a time that is not finite throws
  // std::invalid_argument.
  bool add_frame(int number, double time_s, const unsigned char* pixels, int width_px, int height_px);
  // NaN coordinates: that corner is hidden.
  bool add_corners(double time_s, const Eigen::Vector3d& left, const Eigen::Vector3d& right);
  bool add_marker(double time_s, int marker, const Eigen::Vector2d& uv_m, const Eigen::Vector3d& position);
  bool add_robot(double time_s, const Eigen::Vector3d& commanded, const Eigen::Vector3d& measured);

  Recorded recorded() const;
  // Empty, or why nothing more is kept (the disk).
  std::string failure() const;

  // Waits for the queue, syncs, and writes the final trial.json: "complete", or "cut" where `cut_because` is given or
  // the disk failed. A trial that it calls complete is durable, all of it. extra: as above, for what is known only now.
  // Returns the trial's state. Throws std::runtime_error where trial.json itself cannot be written or synced: the trial
  // then still says "recording".
  trial::State finish(const std::string& cut_because = "", const nlohmann::json& extra = nlohmann::json::object());

 private:
  struct Table {
    std::unique_ptr<files::AppendFile> file;
    double last_time_s = 0;
    RowCounts rows;
  };

  bool append(Table& table, const char* name, double time_s, const std::string& row);
  void sync_now_and_then();
  void stop_syncing();
  bool make_durable();

  const std::filesystem::path folder_;
  const RecorderOptions options_;
  nlohmann::json trial_json_;
  int width_px_ = 0, height_px_ = 0;
  int folder_descriptor_ = -1;  // locked while recording, so that nobody else recovers the trial

  mutable std::mutex mutex_;
  Table corners_, markers_, robot_;
  int last_number_ = -1;
  double last_frame_s_ = 0;
  nlohmann::json gaps_ = nlohmann::json::array();
  size_t out_of_order_ = 0;
  size_t durable_frames_ = 0;
  std::string failure_;
  bool sync_failed_ = false;
  bool finished_ = false, ending_ = false;
  std::condition_variable ended_;
  std::unique_ptr<FrameWriter> frames_;
  std::thread syncer_;
};

// Ranges of missing numbers between the first and the last of `numbers` (ascending).
nlohmann::json number_gaps(const std::vector<int>& numbers);

}  // namespace selvedge::capture
