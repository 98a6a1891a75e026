#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "rig/arm/control_server.h"
#include "rig/arm/stop_latch.h"
#include "rig/clock.h"
#include "rig/wire/bytes.h"

namespace selvedge::arm {
namespace {

namespace fs = std::filesystem;
using selvedge_rig::arm_command_t;
using selvedge_rig::arm_control_t;

class Server : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / fmt::format("selvedge-control-{}", ::getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  // A server and a loop that does whatever it is asked.
  struct Running {
    Running(const fs::path& socket, std::vector<uid_t> users)
        : server(
              socket, std::move(users), [this](const std::string& text) { note(text); }, [this] { return not_kept; }),
          loop([this] {
            while (!ending) {
              for (const auto& message : server.take())
                if (const auto* control = std::get_if<arm_control_t>(&message.what)) {
                  ++controls;
                  server.answer(message.sender, control->sequence, control->reason == "no" ? "would not" : "");
                }
              std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
          }) {}
    ~Running() {
      ending = true;
      loop.join();
    }
    void note(const std::string& text) {
      const std::lock_guard lock(mutex);
      ++stops;
      why = text;
    }
    std::string not_kept;  // set before there is anybody to ask
    std::mutex mutex;
    std::string why;
    std::atomic<int> stops = 0, controls = 0;
    std::atomic<bool> ending = false;
    ControlServer server;
    std::thread loop;
  };
  template <class Condition>
  static bool wait_for(Condition condition) {
    for (int i = 0; i < 4000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return condition();
  }
  fs::path folder_;
};

TEST_F(Server, AnswersAndRefusalsReachWhoeverAsked) {
  Running running(folder_ / "s", {::geteuid()});
  ControlClient client(folder_ / "s");
  EXPECT_NO_THROW(client.arm("yes"));
  try {
    client.arm("no");
    FAIL();
  } catch (const ControlRefused& refused) { EXPECT_STREQ(refused.what(), "arm: would not"); }
  EXPECT_NO_THROW(client.stop("stop"));
  EXPECT_EQ(running.stops, 1);
}

TEST_F(Server, OthersMayStopAlone) {
  Running running(folder_ / "s", {::geteuid() + 1});  // this process is the other user
  ControlClient client(folder_ / "s");
  EXPECT_THROW(client.arm("yes"), ControlRefused);
  EXPECT_THROW(client.reset(1, "yes"), ControlRefused);
  EXPECT_THROW(client.send({}), ControlRefused);
  EXPECT_EQ(running.controls, 0);
  EXPECT_NO_THROW(client.stop("stop"));
  EXPECT_EQ(running.stops, 1);
}

// The stop comes after more than anybody's queue holds, and the loop takes nothing.
TEST_F(Server, AStopDoesNotQueue) {
  std::atomic<int> stops = 0;
  ControlServer server(
      folder_ / "s", {::geteuid()}, [&](const std::string&) { ++stops; }, [] { return ""; });
  const wire::Socket flood = wire::connect_unix(folder_ / "s");
  arm_command_t command{};
  for (int i = 0; i < 10000; ++i) flood.send(encode_frame(FrameKind::command, command), 20);
  EXPECT_TRUE(wait_for([&] { return server.refused() >= 10000 - static_cast<int64_t>(ControlServer::kQueue); }));
  arm_control_t stop{};
  stop.action = arm_control_t::STOP;
  flood.send(encode_frame(FrameKind::control, stop));
  EXPECT_TRUE(wait_for([&] { return stops == 1; }));
  EXPECT_NO_THROW(ControlClient(folder_ / "s").stop("another connection"));
  const auto waited = server.take();
  EXPECT_EQ(std::count_if(waited.begin(), waited.end(),  // beside the word that the other connection has ended
                          [](const auto& m) { return std::holds_alternative<arm_command_t>(m.what); }),
            static_cast<long>(ControlServer::kQueue));
}

TEST_F(Server, StopsComeThroughManyConnectionsAndNonsense) {
  Running running(folder_ / "s", {::geteuid()});
  std::vector<wire::Socket> open;
  for (size_t i = 0; i < 3 * ControlServer::kConnections; ++i) {
    open.push_back(wire::connect_unix(folder_ / "s"));
    try {
      open.back().send(
          std::vector<std::uint8_t>{0, 0, 0, static_cast<std::uint8_t>(i), 1, 2, 3});  // half a frame, or a wrong kind
    } catch (const wire::Disconnected&) {}
  }
  EXPECT_NO_THROW(ControlClient(folder_ / "s").stop("through the crowd"));
  EXPECT_EQ(running.stops, 1);
}

TEST_F(Server, TwoDaemonsDoNotShareASocketAndALeftOneIsReplaced) {
  {
    ControlServer first(
        folder_ / "s", {}, [](const std::string&) {}, [] { return ""; });
    EXPECT_THROW(ControlServer(
                     folder_ / "s", {}, [](const std::string&) {}, [] { return ""; }),
                 std::runtime_error);
  }
  const int left = ::socket(AF_UNIX, SOCK_STREAM, 0);  // as a killed daemon leaves it
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  (folder_ / "s").string().copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(left, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ::close(left);
  EXPECT_NO_THROW(ControlServer(
      folder_ / "s", {}, [](const std::string&) {}, [] { return ""; }));
}

// They start within the same moment: the second finds no socket yet, or one that the first has just made.
TEST_F(Server, TwoDaemonsThatStartAtOnceDoNotShareASocket) {
  const auto start = [&] {
    return std::make_unique<ControlServer>(
        folder_ / "s", std::vector<uid_t>{}, [](const std::string&) {}, [] { return ""; });
  };
  const auto first = start();
  fs::rename(folder_ / "s", folder_ / "aside");  // as the second sees it before the first has bound
  EXPECT_THROW(start(), std::runtime_error);
}

// A crowd that comes faster than it is read, each to say one thing: none goes unheard for the next to come in. One that
// had to make room before it had said anything comes again.
TEST_F(Server, WhatWasSentIsHeardBeforeItsConnectionMakesRoom) {
  constexpr int kEach = 300;
  std::atomic<int> stops = 0;
  ControlServer server(
      folder_ / "s", {::geteuid()}, [&](const std::string&) { ++stops; }, [] { return ""; });
  arm_control_t stop{};
  stop.action = arm_control_t::STOP;
  std::vector<std::vector<wire::Socket>> open(4);
  std::vector<std::thread> crowd;
  for (auto& own : open)
    crowd.emplace_back([&] {
      for (int i = 0; i < kEach;) {
        own.push_back(wire::connect_unix(folder_ / "s"));
        try {
          own.back().send(encode_frame(FrameKind::control, stop));
          ++i;
        } catch (const wire::Disconnected&) {}
      }
    });
  for (std::thread& one : crowd) one.join();
  EXPECT_TRUE(wait_for([&] { return stops == static_cast<int>(open.size()) * kEach; })) << stops;
}

TEST_F(Server, ACrowdOfAnotherUserDrivesNobodyElseOut) {
  Running running(folder_ / "s", {::geteuid()});
  ControlClient person(folder_ / "s");
  EXPECT_NO_THROW(person.arm("yes"));
  fs::permissions(folder_, fs::perms::others_exec, fs::perm_options::add);
  const pid_t crowd = ::fork();
  if (crowd == 0) {  // nobody, where this is root; else the same user, whose quietest is the person
    if (::geteuid() == 0 && ::setuid(65534) != 0) ::_exit(2);
    std::vector<wire::Socket> open;
    for (size_t i = 0; i < 2 * ControlServer::kConnections; ++i) open.push_back(wire::connect_unix(folder_ / "s"));
    ::_exit(0);
  }
  int ended = 0;
  ::waitpid(crowd, &ended, 0);
  EXPECT_EQ(ended, 0);
  if (::geteuid() == 0) {
    EXPECT_NO_THROW(person.stop("through the crowd"));
    EXPECT_EQ(running.stops, 1);
  }
}

TEST_F(Server, AStopThatCannotBeKeptActsAndSaysSo) {
  Running running(folder_ / "s", {::geteuid()});
  running.not_kept = "no space left";
  ControlClient client(folder_ / "s");
  try {
    client.stop("stop");
    FAIL() << "acknowledged";
  } catch (const ControlRefused& refused) {
    EXPECT_NE(std::string(refused.what()).find("it is stopped, but"), std::string::npos) << refused.what();
    EXPECT_NE(std::string(refused.what()).find("no space left"), std::string::npos) << refused.what();
  }
  EXPECT_EQ(running.stops, 1);
  EXPECT_NO_THROW(client.arm("what is no stop is answered as ever"));
}

// Whoever may stop may not fill the bus with it, nor write to a terminal.
TEST_F(Server, AReasonIsShortAndPlain) {
  Running running(folder_ / "s", {::geteuid()});
  EXPECT_NO_THROW(ControlClient(folder_ / "s").stop("\xff\x1b[2J\n" + std::string(1 << 20, 'x')));
  const std::lock_guard lock(running.mutex);
  EXPECT_LT(running.why.size(), ControlServer::kLongestReason + 100);
  EXPECT_EQ(running.why.find_first_of("\x1b\n\xff"), std::string::npos) << running.why;
}

TEST(ControlFrames, SizesAndKindsThatCannotBeAreRefused) {
  std::vector<std::uint8_t> received = {0xff, 0xff, 0xff, 0xff, 1};
  EXPECT_THROW(take_frame(received), wire::WireError);
  received = {0, 0, 0, 0, 1};
  EXPECT_THROW(take_frame(received), wire::WireError);
  received = {0, 0, 0, 2, 9, 0};
  EXPECT_THROW(take_frame(received), wire::WireError);
  received = {0, 0, 0, 2, 1, 7, 0, 0};
  const auto frame = take_frame(received);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->payload, std::vector<std::uint8_t>{7});
  EXPECT_EQ(received.size(), 2u);
  EXPECT_FALSE(take_frame(received));
  EXPECT_FALSE(decode_payload<arm_control_t>({1, 2, 3}));
}

TEST_F(Server, ALatchIsOnTheDiskOnceItIsSettled) {
  const fs::path file = folder_ / "latch";
  StopLatch latch(file);
  EXPECT_FALSE(latch.left_behind());
  latch.settle();
  EXPECT_FALSE(fs::exists(file));
  latch.pull("first");
  latch.pull("second");
  latch.hold(std::nullopt);  // the loop had not seen it yet: it holds all the same
  latch.settle();
  EXPECT_EQ(StopLatch(file).left_behind(), "first");
  EXPECT_EQ(latch.take()->why, "first");
  EXPECT_FALSE(latch.take());
  latch.hold("first");
  latch.settle();
  EXPECT_TRUE(fs::exists(file));
  latch.hold(std::nullopt);  // it was reset
  latch.settle();
  EXPECT_FALSE(fs::exists(file));
}

// Only its absence says that nothing was stopped.
TEST_F(Server, ALatchThatCannotBeReadIsAStop) {
  const fs::path file = folder_ / "latch";
  EXPECT_FALSE(StopLatch(file).left_behind());
  std::ofstream(file).flush();
  EXPECT_TRUE(StopLatch(file).left_behind()) << "empty";
  fs::remove(file);
  fs::create_symlink(folder_ / "nowhere", file);
  EXPECT_TRUE(StopLatch(file).left_behind()) << "a link to nowhere";
  fs::remove(file);
  fs::create_directory(file);
  EXPECT_TRUE(StopLatch(file).left_behind()) << "a folder";
  fs::remove(file);
  fs::create_symlink(folder_ / "round", folder_ / "round");
  EXPECT_TRUE(StopLatch(folder_ / "round" / "latch").left_behind()) << "a place that cannot be looked at";
}

TEST_F(Server, ALatchThatCannotBeKeptSaysSoUntilItIs) {
  const fs::path file = folder_ / "not yet" / "latch";
  StopLatch latch(file);
  EXPECT_EQ(latch.settle(), "");
  latch.pull("stop");
  EXPECT_NE(latch.settle().find("not yet"), std::string::npos);
  EXPECT_NE(latch.settle(), "");
  fs::create_directory(folder_ / "not yet");
  EXPECT_EQ(latch.settle(), "");
  EXPECT_EQ(StopLatch(file).left_behind(), "stop");
}

}  // namespace
}  // namespace selvedge::arm
