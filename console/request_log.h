// The console's log: one line for each request that changes something, each refusal and each stop, in UTC.
//
// A thread of its own writes it. Whoever adds a line waits for no disk; where lines come faster than the disk takes
// them, the oldest of those that wait are given up.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

namespace spdlog {
class logger;
namespace details {
class thread_pool;
}
}  // namespace spdlog

namespace selvedge::console {

class RequestLog {
 public:
  // An empty path: nothing is kept. Throws BadInput where the file cannot be written.
  explicit RequestLog(const std::filesystem::path& file);
  ~RequestLog();  // what was added is on disk
  RequestLog(const RequestLog&) = delete;
  RequestLog& operator=(const RequestLog&) = delete;

  // who: the peer's address; status: as HTTP has it.
  void add(const std::string& who, const std::string& what, const std::string& text, int status);

 private:
  std::shared_ptr<spdlog::details::thread_pool> writer_;
  std::shared_ptr<spdlog::logger> lines_;
};

}  // namespace selvedge::console
