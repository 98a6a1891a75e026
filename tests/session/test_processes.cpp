#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include "station/child_process.h"

namespace selvedge::station {
namespace {

namespace fs = std::filesystem;

bool exists(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/stat", pid));
  std::string number, name, state;
  return (file >> number >> name >> state) && state != "Z";
}

class ChildProcesses : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / fmt::format("selvedge-processes-{}", ::getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(ChildProcesses, EndWithTheObject) {
  pid_t pid = 0;
  {
    ChildProcess child("sleeper", {"/bin/sleep", "1000"}, folder_ / "log");
    pid = child.pid();
    EXPECT_NO_THROW(child.require_running());
  }
  EXPECT_FALSE(exists(pid));
}

TEST_F(ChildProcesses, EndWithTheirParentEvenWhenItIsKilled) {
  const fs::path note = folder_ / "pid";
  const pid_t parent = ::fork();
  if (parent == 0) {
    ChildProcess child("sleeper", {"/bin/sleep", "1000"}, folder_ / "log");
    std::ofstream(note.string() + ".new") << child.pid() << std::flush;
    fs::rename(note.string() + ".new", note);
    ::pause();
  }
  while (!fs::exists(note)) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  pid_t child = 0;
  std::ifstream(note) >> child;
  EXPECT_TRUE(exists(child));
  ::kill(parent, SIGKILL);
  ::waitpid(parent, nullptr, 0);
  while (exists(child)) std::this_thread::sleep_for(std::chrono::milliseconds(5));  // ctest's limit ends a failure
}

TEST_F(ChildProcesses, AnEndIsReportedWithTheLogsLastLines) {
  ChildProcess child("grumbler", {"/bin/sh", "-c", "echo the lamp is broken; exit 3"}, folder_ / "log");
  std::string text;
  while (text.empty()) {
    try {
      child.require_running();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    } catch (const std::runtime_error& error) { text = error.what(); }
  }
  EXPECT_NE(text.find("grumbler"), std::string::npos);
  EXPECT_NE(text.find("status 3"), std::string::npos);
  EXPECT_NE(text.find("the lamp is broken"), std::string::npos);
}

}  // namespace
}  // namespace selvedge::station
