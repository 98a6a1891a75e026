// A child process that never outlives its parent, with its output in a log file.
//
// The child is told SIGTERM when this object goes, and by the kernel when the thread that started it dies
// (PR_SET_PDEATHSIG), so that nothing is left behind even after kill -9 of the parent. Source: prctl(2).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <sys/types.h>

namespace selvedge::station {

// What a child reads from and writes to; −1: nothing, and its log.
struct Streams {
  int in = -1, out = -1;
};

class ChildProcess {
 public:
  // command[0] is the program's path. Throws std::runtime_error where it cannot be started.
  ChildProcess(std::string name, const std::vector<std::string>& command, const std::filesystem::path& log_file);
  // The leader of a group of its own, which is ended as a whole, within patience_s. streams stay the caller's.
  ChildProcess(std::string name, const std::vector<std::string>& command, const std::filesystem::path& log_file,
               Streams streams, double patience_s);
  ~ChildProcess();  // SIGTERM, then SIGKILL after the patience
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  const std::string& name() const { return name_; }
  pid_t pid() const { return pid_; }
  // Throws std::runtime_error naming the child, how it ended and the last lines of its log.
  void require_running();
  // Whether it ended by itself within so long.
  bool ends_within(double wait_s);
  // Asks the child to end; the destructor waits for it.
  void terminate();

  static constexpr double kPatience_s = 10;

 private:
  bool reap(bool wait);
  void signal(int number) const;
  std::string name_;
  std::filesystem::path log_file_;
  double patience_s_ = kPatience_s;
  pid_t pid_ = -1;
  pid_t group_ = -1;  // that it leads
  int exit_status_ = 0;
};

// Starts a process that lives on by itself (its own session, no terminal). Returns its number.
pid_t start_detached(const std::vector<std::string>& command, const std::filesystem::path& log_file);

}  // namespace selvedge::station
