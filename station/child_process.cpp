#include "station/child_process.h"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <deque>
#include <fstream>
#include <stdexcept>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace selvedge::station {

namespace {

enum class Bond { dies_with_parent, dies_as_group, detached };

// Between fork and exec only calls that a process with threads may make there.
[[noreturn]] void become(char* const* arguments, int log, Streams streams, Bond bond, pid_t parent) {
  if (bond == Bond::detached) {
    ::setsid();
  } else {
    if (bond == Bond::dies_as_group) ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, bond == Bond::dies_as_group ? SIGKILL : SIGTERM);
    if (::getppid() != parent) ::_exit(127);  // it died before the line above
  }
  ::dup2(streams.in >= 0 ? streams.in : ::open("/dev/null", O_RDONLY), 0);
  ::dup2(streams.out >= 0 ? streams.out : log, 1);
  ::dup2(log, 2);
  ::execv(arguments[0], arguments);
  ::_exit(127);
}

pid_t start(const std::vector<std::string>& command, const std::filesystem::path& log_file, Bond bond,
            Streams streams = {}) {
  const int log = ::open(log_file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log < 0) throw std::runtime_error(fmt::format("{}: {}", log_file.string(), std::strerror(errno)));
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) become(arguments.data(), log, streams, bond, parent);
  ::close(log);
  if (pid < 0) throw std::runtime_error(fmt::format("{}: cannot start: {}", command[0], std::strerror(errno)));
  return pid;
}

std::string last_lines(const std::filesystem::path& path, size_t count) {
  std::ifstream file(path);
  std::deque<std::string> lines;
  for (std::string line; std::getline(file, line);) {
    lines.push_back(line);
    if (lines.size() > count) lines.pop_front();
  }
  return fmt::format("{}", fmt::join(lines, " | "));
}

}  // namespace

ChildProcess::ChildProcess(std::string name, const std::vector<std::string>& command,
                           const std::filesystem::path& log_file)
    : name_(std::move(name)), log_file_(log_file), pid_(start(command, log_file, Bond::dies_with_parent)) {}

ChildProcess::ChildProcess(std::string name, const std::vector<std::string>& command,
                           const std::filesystem::path& log_file, Streams streams, double patience_s)
    : name_(std::move(name)), log_file_(log_file), patience_s_(patience_s),
      pid_(start(command, log_file, Bond::dies_as_group, streams)), group_(pid_) {
  ::setpgid(pid_, pid_);  // here too, so that it leads before anybody signals it
}

ChildProcess::~ChildProcess() {
  terminate();
  if (!ends_within(patience_s_)) {
    signal(SIGKILL);
    reap(true);
  }
  if (group_ > 0) ::kill(-group_, SIGKILL);  // whom it left behind
}

void ChildProcess::terminate() { signal(SIGTERM); }

void ChildProcess::signal(int number) const {
  if (pid_ > 0) ::kill(group_ > 0 ? -group_ : pid_, number);
}

bool ChildProcess::ends_within(double wait_s) {
  for (int i = 0; !reap(false); ++i) {
    if (i >= static_cast<int>(wait_s * 50)) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

bool ChildProcess::reap(bool wait) {
  if (pid_ < 0) return true;
  int status = 0;
  if (::waitpid(pid_, &status, wait ? 0 : WNOHANG) != pid_) return false;
  exit_status_ = status;
  pid_ = -1;
  return true;
}

void ChildProcess::require_running() {
  if (!reap(false)) return;
  const std::string how = WIFSIGNALED(exit_status_) ? fmt::format("was ended by signal {}", WTERMSIG(exit_status_))
                                                    : fmt::format("ended with status {}", WEXITSTATUS(exit_status_));
  throw std::runtime_error(
      fmt::format("{} {}; its log {} ends with: {}", name_, how, log_file_.string(), last_lines(log_file_, 3)));
}

pid_t start_detached(const std::vector<std::string>& command, const std::filesystem::path& log_file) {
  return start(command, log_file, Bond::detached);
}

}  // namespace selvedge::station
