// Records one trial straight into the exchange format. Whatever was acknowledged stays readable after
// kill -9 of this process or a full disk.
//
// Times are already those of the motion-capture clock. trial.json is there from the start with "state":
// "recording"; `finish` puts "complete" or "cut" in its place, atomically, with the number of frames and
// every gap in their numbers:
//   "frames": {"count", "gaps": [[first missing, last missing], …], "refused": frames not kept up with},
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
  double flush_interval_s = 1;  // flushes to the disk itself, against a loss of power; 0: only at the end
};

struct Recorded {
  FrameCounts frames;
  size_t corner_samples = 0, marker_samples = 0, robot_samples = 0;
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

  // Each kind may come from a thread of its own. True: accepted; frames are acknowledged later (`recorded`), the others
  // at once. False: not kept, and counted. A wrong image size or a time that is not finite throws
  // std::invalid_argument.
  bool add_frame(int number, double time_s, const unsigned char* pixels, int width_px, int height_px);
  // NaN coordinates: that corner is hidden.
  bool add_corners(double time_s, const Eigen::Vector3d& left, const Eigen::Vector3d& right);
  bool add_marker(double time_s, int marker, const Eigen::Vector2d& uv_m, const Eigen::Vector3d& position);
  bool add_robot(double time_s, const Eigen::Vector3d& commanded, const Eigen::Vector3d& measured);

  Recorded recorded() const;
  // Empty, or why nothing more is kept (the disk).
  std::string failure() const;

  // Waits for the queue, flushes, and writes the final trial.json: "complete", or "cut" where `cut_because`
  // is given or the disk failed. extra: as above, for what is known only now. Returns the trial's state.
  trial::State finish(const std::string& cut_because = "", const nlohmann::json& extra = nlohmann::json::object());

 private:
  struct Table {
    std::unique_ptr<files::AppendFile> file;
    double last_time_s = 0;
    size_t rows = 0;
  };

  bool append(Table& table, const char* name, const char* header, double time_s, const std::string& row);
  void flush_now_and_then();
  void stop_flushing();

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
  std::string failure_;
  bool finished_ = false, ending_ = false;
  std::condition_variable ended_;
  std::unique_ptr<FrameWriter> frames_;
  std::thread flusher_;
};

// A trial whose recorder went away: cuts torn lines and unlisted images off and marks the trial as cut.
// Returns false where there is nothing to do. Throws BadInput where it is still being recorded.
bool recover(const std::filesystem::path& trial_folder);

// Ranges of missing numbers between the first and the last of `numbers` (ascending).
nlohmann::json number_gaps(const std::vector<int>& numbers);

}  // namespace selvedge::capture
