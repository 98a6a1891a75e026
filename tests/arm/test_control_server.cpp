#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
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
              socket, std::move(users), [this](const std::string&) { ++stops; }, [] {}),
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
      folder_ / "s", {::geteuid()}, [&](const std::string&) { ++stops; }, [] {});
  const wire::Socket flood = wire::connect_unix(folder_ / "s");
  arm_command_t command{};
  for (int i = 0; i < 10000; ++i) flood.send(encode_frame(FrameKind::command, command), 20);
  EXPECT_TRUE(wait_for([&] { return server.refused() >= 10000 - static_cast<int64_t>(ControlServer::kQueue); }));
  arm_control_t stop{};
  stop.action = arm_control_t::STOP;
  flood.send(encode_frame(FrameKind::control, stop));
  EXPECT_TRUE(wait_for([&] { return stops == 1; }));
  EXPECT_NO_THROW(ControlClient(folder_ / "s").stop("another connection"));
  EXPECT_EQ(server.take().size(), ControlServer::kQueue);
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
        folder_ / "s", {}, [](const std::string&) {}, [] {});
    EXPECT_THROW(ControlServer(
                     folder_ / "s", {}, [](const std::string&) {}, [] {}),
                 std::runtime_error);
  }
  const int left = ::socket(AF_UNIX, SOCK_STREAM, 0);  // as a killed daemon leaves it
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  (folder_ / "s").string().copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(left, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ::close(left);
  EXPECT_NO_THROW(ControlServer(
      folder_ / "s", {}, [](const std::string&) {}, [] {}));
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

}  // namespace
}  // namespace selvedge::arm
