#include "cli/verify/soak/frame_audit.h"

#include <algorithm>
#include <cstdlib>
#include <set>

#include <fmt/format.h>

#include "capture/recovery.h"
#include "capture/trial/trial.h"
#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;
constexpr const char* kSpoiled = "-spoiled-";

}  // namespace

void FrameAudit::hear(const selvedge_rig::session_status_t& status) {
  if (status.trial.empty() || status.message.rfind("attempt ", 0) != 0) return;
  const int attempt = std::atoi(status.message.c_str() + 8);
  const std::lock_guard lock(mutex_);
  int64_t& told = told_[{status.trial, attempt}];
  told = std::max(told, status.frames_written);
}

void FrameAudit::look(bool all) {
  // Attempts that somebody told of, and folders that nobody did.
  std::map<std::pair<std::string, int>, int64_t> attempts;
  {
    const std::lock_guard lock(mutex_);
    attempts = told_;
  }
  for (const auto& entry : fs::directory_iterator(trials_)) {
    if (!entry.is_directory()) continue;
    const std::string name = entry.path().filename().string();
    const size_t spoiled = name.find(kSpoiled);
    const std::string trial = name.substr(0, spoiled);
    if (spoiled != std::string::npos)
      attempts.try_emplace({trial, std::atoi(name.c_str() + spoiled + std::string(kSpoiled).size())}, 0);
    else if (attempts.lower_bound({trial, 0}) == attempts.upper_bound({trial, 1 << 30}))
      attempts.try_emplace({trial, 1}, 0);
  }
  if (attempts.empty()) return;
  const std::string newest = attempts.rbegin()->first.first;
  for (const auto& [key, told] : attempts)
    if (all || key.first != newest) {
      const auto next = std::next(attempts.find(key));
      audit(key.first, key.second, told, next == attempts.end() || next->first.first != key.first);
    }
}

// Frames that a trial.json which is final promises.
int64_t FrameAudit::said_in(const fs::path& folder) {
  const auto json = files::read_json(folder / "trial.json");
  return json.at("state") == "recording" ? 0 : json.at("frames").at("count").get<int64_t>();
}

void FrameAudit::audit(const std::string& trial, int attempt, int64_t told, bool last) {
  const fs::path spoiled = trials_ / (trial + kSpoiled + std::to_string(attempt));
  const fs::path folder = fs::exists(spoiled) || !last ? spoiled : trials_ / trial;
  int64_t written = told, readable = 0;
  std::string why;
  try {
    // A folder without trial.json never got as far as to write anything.
    if (fs::exists(folder / "trial.json") || told > 0) {
      written = std::max(written, said_in(folder));
      capture::recover(folder);
      const trial::Trial found = trial::read_trial(folder);
      (found.state == trial::State::complete ? complete_ : cut_) += 1;
      const size_t frames = found.frames ? found.frames->number.size() : 0;
      for (size_t i = 0; i < frames; ++i) {
        trial::read_frame(found, i);
        ++readable;
      }
    }
  } catch (const BadInput& error) {
    why = error.what();
    if (why.find("is being recorded") != std::string::npos) return;  // later
  } catch (const std::exception& error) { why = error.what(); }
  const int64_t lost = std::max<int64_t>(0, written - readable);
  written_ += written;
  lost_ += lost;
  {
    const std::lock_guard lock(mutex_);
    told_.erase({trial, attempt});
  }
  if (lost > 0) {
    losses_.push_back(fmt::format("{} attempt {}: {} frames written, {} readable{}", trial, attempt, written, readable,
                                  why.empty() ? "" : ": " + why));
    if (fs::exists(folder))
      fs::copy(folder, trials_.parent_path() / (folder.filename().string() + "-lost"),
               fs::copy_options::recursive);  // off the small disk
  }
  fs::remove_all(folder);
}

}  // namespace selvedge::cli
