#include "console/request_log.h"

#include <ctime>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/async.h>
#include <spdlog/sinks/basic_file_sink.h>

#include "files/bad_input.h"

namespace selvedge::console {

namespace {
constexpr size_t kLinesThatWait = 1024;
}

RequestLog::RequestLog(const std::filesystem::path& file) {
  if (file.empty()) return;
  try {
    const auto sink = std::make_shared<spdlog::sinks::basic_file_sink_mt>(file.string());
    writer_ = std::make_shared<spdlog::details::thread_pool>(kLinesThatWait, 1);
    lines_ =
        std::make_shared<spdlog::async_logger>("console", sink, writer_, spdlog::async_overflow_policy::overrun_oldest);
  } catch (const spdlog::spdlog_ex& error) { refuse(file.string(), "cannot be written: {}", error.what()); }
  lines_->set_pattern("%v");
  lines_->flush_on(spdlog::level::info);
}

RequestLog::~RequestLog() = default;

void RequestLog::add(const std::string& who, const std::string& what, const std::string& text, int status) {
  if (!lines_) return;
  std::string line =
      fmt::format("{:%Y-%m-%dT%H:%M:%SZ} {} {} {} {:.400}", fmt::gmtime(std::time(nullptr)), who, status, what, text);
  for (char& c : line)
    if (static_cast<unsigned char>(c) < ' ') c = ' ';  // what a stranger sends makes no lines of its own
  lines_->info("{}", line);
}

}  // namespace selvedge::console
