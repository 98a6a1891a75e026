// A child process that is told things on its standard input and answers on its standard output; what it writes to its
// standard error goes to a log file.
//
// It never outlives its parent, nor do processes that it started itself (child_process.h). What it is told and what it
// answers cross in whatever order: neither side waits for the other to read. Every refusal names the child and what it
// did: exited (how, and the last lines of its log), did not answer in time, answered too long a line.
#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "station/child_process.h"

namespace selvedge::station {

using TalkDeadline = std::chrono::steady_clock::time_point;
TalkDeadline within(double seconds);

class TalkingProcess {
 public:
  // command: a line for the shell. Call it from a thread that outlives the child. Throws std::runtime_error where no
  // process can be made.
  TalkingProcess(std::string name, const std::string& command, const std::filesystem::path& log_file);
  ~TalkingProcess();
  TalkingProcess(const TalkingProcess&) = delete;
  TalkingProcess& operator=(const TalkingProcess&) = delete;

  // Sent while answers are waited for.
  void tell(std::string_view bytes) { unsent_.append(bytes); }
  // The next line, without its end; the next `count` bytes, put there. Both throw BadInput.
  std::string line(TalkDeadline deadline, size_t most_bytes);
  void bytes(char* into, size_t count, TalkDeadline deadline);
  // How many bytes it has written that nobody has asked for yet.
  size_t unread();
  // Closes its standard input: whether it ended by itself within so long.
  bool ends_when_told(double wait_s);

 private:
  size_t exchange(char* into, size_t most, TalkDeadline deadline);
  size_t read_some(char* into, size_t most);
  void take_what_came(TalkDeadline deadline);
  void send_some();
  [[noreturn]] void refuse_its_end();

  std::string name_;
  int to_ = -1, from_ = -1;
  std::optional<ChildProcess> child_;
  std::string unsent_, came_;
  size_t sent_ = 0, taken_ = 0;  // of these
};

}  // namespace selvedge::station
