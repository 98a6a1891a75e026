// A person at the terminal that this process was started from, where there is one.
#pragma once

#include <string>

namespace selvedge::session {

class Terminal {
 public:
  Terminal();
  bool there() const { return there_; }
  void say(const std::string& text) const;  // only where somebody is there
  // A line that was typed, without its end; "" where none came within wait_ms.
  std::string line(int wait_ms);

 private:
  bool there_ = false;
};

}  // namespace selvedge::session
