#include "station/journal.h"

#include <ctime>
#include <sstream>

#include <fmt/chrono.h>

#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
using State = StepRecord::State;
using nlohmann::json;

constexpr const char* kJournalFile = "journal.jsonl";

State state_of(const std::string& text) {
  for (const State state : {State::begun, State::done, State::failed, State::skipped})
    if (text == to_text(state)) return state;
  return State::none;
}

// Empty where there is none, or something else than a text.
std::string text_at(const json& line, const char* key) {
  const auto found = line.find(key);
  return found != line.end() && found->is_string() ? found->get<std::string>() : "";
}

void take_up(std::map<std::string, StepRecord>& records, const json& line) {
  const State state = state_of(text_at(line, "state"));
  if (state == State::none) return;
  StepRecord& record = records[text_at(line, "step")];
  record.state = state;
  if (state == State::begun) ++record.attempts;
  if (state == State::failed || state == State::skipped) record.why = text_at(line, "why");
  if (line.contains("seconds") && line["seconds"].is_number()) record.seconds = line["seconds"].get<double>();
  if (line.contains("result")) record.result = line["result"];
}

// Null where it is no JSON, or nests too deep.
json parsed(const std::string& line) {
  try {
    return files::parse_json(line, kJournalFile);
  } catch (const BadInput&) { return nullptr; }
}

}  // namespace

const char* to_text(State state) {
  switch (state) {
    case State::begun: return "begun";
    case State::done: return "done";
    case State::failed: return "failed";
    case State::skipped: return "skipped";
    case State::none: break;
  }
  return "not begun";
}

std::map<std::string, StepRecord> read_journal(const fs::path& folder) {
  std::map<std::string, StepRecord> records;
  if (!fs::is_regular_file(folder / kJournalFile)) return records;
  std::istringstream lines(files::read_whole(folder / kJournalFile));
  for (std::string line; std::getline(lines, line);) {
    const json entry = parsed(line);
    if (entry.is_object()) take_up(records, entry);
  }
  return records;
}

Journal::Journal(const fs::path& folder, const std::string& session_text) {
  fs::create_directories(folder);
  lock_ = std::make_unique<files::Lock>(folder / "session.lock");
  if (!lock_->held()) refuse(folder.string(), "another session runs in this folder");
  const fs::path journal = folder / kJournalFile, copy = folder / "session.toml";
  if (fs::exists(journal)) {
    if (!fs::exists(copy) || files::read_whole(copy) != session_text)
      refuse(folder.string(),
             "its journal belongs to another session, or the session file was changed since it began; {} is that file. "
             "Expected the same, or another --out",
             copy.string());
    file_ = std::make_unique<files::AppendFile>(journal);
    records_ = read_journal(folder);
  } else {
    files::write_whole(copy, session_text);
    file_ = std::make_unique<files::AppendFile>(journal, json{{"format", "session-journal/1"}}.dump() + "\n");
  }
}

StepRecord Journal::record(const std::string& step) const {
  const auto found = records_.find(step);
  return found == records_.end() ? StepRecord{} : found->second;
}

void Journal::append(const std::string& step, State state, double seconds, const std::string& why, const json& result) {
  json line = {{"step", step},
               {"state", to_text(state)},
               {"at", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))}};
  if (state == State::begun) line["attempt"] = record(step).attempts + 1;
  if (state == State::done || state == State::failed) line["seconds"] = seconds;
  if (!why.empty()) line["why"] = why;
  if (!result.is_null()) line["result"] = result;
  file_->append(line.dump(-1, ' ', false, json::error_handler_t::replace) + "\n");
  file_->sync();
  take_up(records_, line);
}

void Journal::begun(const std::string& step) { append(step, State::begun, 0, "", nullptr); }
void Journal::done(const std::string& step, double seconds, const json& result) {
  append(step, State::done, seconds, "", result);
}
void Journal::failed(const std::string& step, double seconds, const std::string& why) {
  append(step, State::failed, seconds, why, nullptr);
}
void Journal::skipped(const std::string& step, const std::string& why) {
  append(step, State::skipped, 0, why, nullptr);
}

}  // namespace selvedge::station
