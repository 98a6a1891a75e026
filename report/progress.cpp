#include "report/progress.h"

#include <chrono>
#include <memory>

#include <fmt/format.h>
#include <unistd.h>

namespace selvedge::report {

namespace {

using Clock = std::chrono::steady_clock;

struct Line {
  std::string title;
  Clock::time_point start = Clock::now();
  Clock::time_point last_shown;
  bool terminal = ::isatty(2) != 0;
  bool finished = false;
};

std::string minutes(double seconds) {
  const int whole = static_cast<int>(seconds + 0.5);
  return fmt::format("{}:{:02d}", whole / 60, whole % 60);
}

void show(Line& line, double done, const std::string& what) {
  const auto now = Clock::now();
  const double since = std::chrono::duration<double>(now - line.last_shown).count();
  const bool end = done >= 1;
  if (line.finished || (!end && since < (line.terminal ? 0.2 : 5.0))) return;
  line.last_shown = now;
  line.finished = end;
  const double elapsed = std::chrono::duration<double>(now - line.start).count();
  const std::string left = done > 0.01 ? minutes(elapsed * (1 - done) / done) : "?";
  fmt::print(stderr, "{}{} {:3.0f} %  {} elapsed, {} left  {}{}", line.terminal ? "\r\x1b[K" : "", line.title,
             100 * done, minutes(elapsed), left, what, line.terminal && !end ? "" : "\n");
  std::fflush(stderr);
}

}  // namespace

ProgressCallback terminal_progress(const std::string& title) {
  auto line = std::make_shared<Line>();
  line->title = title;
  return [line](double done, const std::string& what) { show(*line, done, what); };
}

}  // namespace selvedge::report
