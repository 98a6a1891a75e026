#include "capture/session/terminal.h"

#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <fmt/format.h>

namespace selvedge::session {

Terminal::Terminal() : there_(::isatty(0) != 0) {}

// What was typed before the question is no answer to it.
void Terminal::say(const std::string& text) const {
  if (!there_) return;
  ::tcflush(0, TCIFLUSH);
  fmt::print(stderr, "\n{} ", text);
}

std::string Terminal::line(int wait_ms) {
  pollfd input{0, POLLIN, 0};
  if (::poll(&input, there_ ? 1 : 0, wait_ms) <= 0) return "";
  char typed[64] = {};
  if (::read(0, typed, sizeof typed - 1) <= 0) {
    there_ = false;  // it was hung up
    return "";
  }
  const std::string text = typed;
  return text.substr(0, text.find('\n'));
}

}  // namespace selvedge::session
