// What a session has done so far, one line of JSON a happening, so that a session killed at any step goes on from
// there.
//
//   {"step": "linen/record/waving-1", "state": "begun" | "done" | "failed" | "skipped", "attempt": 1, "at":
//   "2026-03-01T12:00:00Z",
//    "seconds": 12.3, "why": "…", "result": {…}}
//
// The first line says which session file it belongs to. A step that is begun and neither done, failed nor skipped was
// cut off.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "files/append_file.h"
#include "files/lock.h"

namespace selvedge::station {

struct StepRecord {
  enum class State { none, begun, done, failed, skipped };
  State state = State::none;
  int attempts = 0;       // begun so far
  double seconds = 0;     // of the last attempt that ended
  std::string why;        // of the last failure
  nlohmann::json result;  // of a step that is done
};

const char* to_text(StepRecord::State state);

// The journal of a folder as it stands, for whoever only looks. Lines that cannot be read are passed over.
std::map<std::string, StepRecord> read_journal(const std::filesystem::path& folder);

class Journal {
 public:
  // FOLDER/journal.jsonl, and FOLDER/session.toml, the session file as it was at the start. Throws BadInput where the
  // folder's journal belongs to another file, or another process holds it.
  Journal(const std::filesystem::path& folder, const std::string& session_text);
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  StepRecord record(const std::string& step) const;
  void begun(const std::string& step);
  void done(const std::string& step, double seconds, const nlohmann::json& result);
  void failed(const std::string& step, double seconds, const std::string& why);
  void skipped(const std::string& step, const std::string& why);

 private:
  void append(const std::string& step, StepRecord::State state, double seconds, const std::string& why,
              const nlohmann::json& result);

  std::unique_ptr<files::AppendFile> file_;
  std::map<std::string, StepRecord> records_;
  std::unique_ptr<files::Lock> lock_;
};

}  // namespace selvedge::station
