// What the recorder called written, held against what can be read once it is gone.
//
// The recorder says on SESSION_STATUS how many frames of an attempt are written, whatever becomes of it; the trial.json
// of a trial that ended says it as well. A frame counts as readable where the project's own reader lists it and decodes
// its image.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <selvedge_rig/session_status_t.hpp>

namespace selvedge::cli {

class FrameAudit {
 public:
  // trials: below it lies a folder for each attempt.
  explicit FrameAudit(std::filesystem::path trials) : trials_(std::move(trials)) {}

  // From any thread.
  void hear(const selvedge_rig::session_status_t& status);

  // Recovers, reads and counts every trial whose recorder has let go of it and that is older than the newest; with
  // `all` that one too. Removes what it found in order, so that a long run does not fill the disk.
  void look(bool all);

  int complete() const { return complete_; }
  int cut() const { return cut_; }
  int64_t written() const { return written_; }
  int64_t lost() const { return lost_; }
  const std::vector<std::string>& losses() const { return losses_; }  // one sentence a trial that lost something

 private:
  // last: of the trial's attempts. Its folder has the trial's plain name; an attempt before it left its own, or none.
  void audit(const std::string& trial, int attempt, int64_t told, bool last);
  int64_t said_in(const std::filesystem::path& folder);

  const std::filesystem::path trials_;
  std::mutex mutex_;
  std::map<std::pair<std::string, int>, int64_t> told_;  // guarded: trial and attempt, frames written
  int complete_ = 0, cut_ = 0;
  int64_t written_ = 0, lost_ = 0;
  std::vector<std::string> losses_;
};

}  // namespace selvedge::cli
