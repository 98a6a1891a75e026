// The console's stop: from anybody, whatever follows it, and whatever else goes on at its ports.
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <condition_variable>
#include <fcntl.h>

#include "console/stop_port.h"
#include "tests/console/console_server.h"
#include "tests/console/crowd.h"

namespace selvedge::console {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

// What a port answers to these bytes.
std::string answer_to(int port, const std::string& text) {
  const wire::Socket socket = wire::connect_tcp("127.0.0.1", port, 30);
  say(socket, text);
  return all_said_by(socket);
}

bool is_stopped(const std::string& answer) {
  return answer.starts_with("HTTP/1.1 200 OK") && answer.find("{\"stopped\":true}") != std::string::npos;
}

// Room for this many connections, both ends of which lie in this process.
void need_descriptors(rlim_t count) {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = std::min(limit.rlim_max, std::max(limit.rlim_cur, count));
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

class StopPortTest : public testing::Test {
 protected:
  StopPort& open(StopPortOptions options = {}) {
    port_ = std::make_unique<StopPort>(options, [this](const std::string& peer) {
      std::unique_lock lock(mutex_);
      ++stops_;
      peer_ = peer;
      released_.wait(lock, [this] { return stops_ > held_; });
      if (!fails_.empty()) throw std::runtime_error(fails_);
    });
    return *port_;
  }
  void release() {
    {
      const std::lock_guard lock(mutex_);
      held_ = 0;
    }
    released_.notify_all();
  }
  int stops() {
    const std::lock_guard lock(mutex_);
    return stops_;
  }

  std::mutex mutex_;
  std::condition_variable released_;
  int stops_ = 0, held_ = 0;  // so many of the first stops last until they are released
  std::string peer_, fails_;
  std::unique_ptr<StopPort> port_;
};

TEST_F(StopPortTest, ActsOnTheFirstBytesWhateverFollows) {
  const int port = open().port();
  int wanted = 0;
  for (const char* request :
       {"POST /stop ", "POST /stop\n", "\r\nPOST /stop HTTP/1.1\r\n",
        "POST /stop HTTP/1.1\r\nContent-Length: 1000000\r\n\r\n{not json", "POST /stop?why=because HTTP/1.0\r\n\r\n",
        "POST /stop HTTP/1.1\r\nOrigin: http://elsewhere.example\r\nHost: rebound.example\r\n\r\n"}) {
    EXPECT_TRUE(is_stopped(answer_to(port, request))) << request;
    EXPECT_EQ(stops(), ++wanted) << request;
  }
  EXPECT_TRUE(peer_.starts_with("127.0.0.1:")) << peer_;
}

TEST_F(StopPortTest, ActsWhenItsBytesComeOneByOne) {
  const wire::Socket socket = wire::connect_tcp("127.0.0.1", open().port(), 30);
  for (const char c : std::string("POST /sto")) {
    say(socket, {c});
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_EQ(stops(), 0);
  say(socket, "p ");
  EXPECT_TRUE(is_stopped(all_said_by(socket)));
}

TEST_F(StopPortTest, DoesNothingElse) {
  const int port = open().port();
  EXPECT_NE(answer_to(port, "GET / HTTP/1.1\r\n").find("This port stops the arm, and does nothing else"),
            std::string::npos);
  EXPECT_TRUE(answer_to(port, "OPTIONS /stop HTTP/1.1\r\n").starts_with("HTTP/1.1 200 OK"));
  for (const char* request : {"POST /stopper HTTP/1.1\r\n", "POST /arm HTTP/1.1\r\n", "PUT /stop HTTP/1.1\r\n"})
    EXPECT_TRUE(answer_to(port, request).starts_with("HTTP/1.1 404")) << request;
  EXPECT_EQ(answer_to(port, "GET /stop HTTP/1.1\r\n").find("{\"stopped\":"), std::string::npos);
  EXPECT_TRUE(answer_to(port, std::string(5000, 'x')).starts_with("HTTP/1.1 404"));
  EXPECT_EQ(stops(), 0);
}

TEST_F(StopPortTest, LetsPagesOfAnyAddressReadTheAnswer) {
  EXPECT_NE(answer_to(open().port(), "POST /stop HTTP/1.1\r\n\r\n").find("Access-Control-Allow-Origin: *\r\n"),
            std::string::npos);
}

TEST_F(StopPortTest, SaysWhatWentWrong) {
  fails_ = "the arm has not said \"stopped\"";
  const std::string answer = answer_to(open().port(), "POST /stop HTTP/1.1\r\n\r\n");
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 500")) << answer;
  EXPECT_NE(answer.find(R"({"error":"the arm has not said \"stopped\""})"), std::string::npos) << answer;
}

TEST_F(StopPortTest, AStopThatLastsHoldsUpNoOther) {
  held_ = 1;
  const int port = open().port();
  const wire::Socket first = wire::connect_tcp("127.0.0.1", port, 30);
  say(first, "POST /stop ");
  ASSERT_TRUE(comes_true([&] { return stops() == 1; }));
  EXPECT_TRUE(is_stopped(answer_to(port, "POST /stop ")));
  EXPECT_EQ(stops(), 2);
  EXPECT_FALSE(first.readable(0)) << "answered before it was done";
  release();
  EXPECT_TRUE(is_stopped(all_said_by(first)));
}

TEST_F(StopPortTest, WhoAsksWhileAllDoersAreBusyIsAnsweredByTheNextStop) {
  held_ = 2;
  StopPortOptions options;
  options.doers = 2;
  const int port = open(options).port();
  std::vector<wire::Socket> askers;
  const auto ask = [&] {
    askers.push_back(wire::connect_tcp("127.0.0.1", port, 30));
    say(askers.back(), "POST /stop ");
  };
  for (int busy = 1; busy <= 2; ++busy) {
    ask();
    ASSERT_TRUE(comes_true([&] { return stops() == busy; }));
  }
  for (int i = 0; i < 20; ++i) ask();
  EXPECT_FALSE(askers.back().readable(0.3));
  EXPECT_EQ(stops(), 2);
  release();
  for (const wire::Socket& asker : askers) EXPECT_TRUE(is_stopped(all_said_by(asker)));
  EXPECT_GT(stops(), 2);
  EXPECT_LE(stops(), 4) << "twenty who waited share a stop or two";
}

TEST_F(StopPortTest, TheOldestHalfOpenConnectionMakesRoom) {
  need_descriptors(1024);
  const int port = open().port();
  std::vector<wire::Socket> idle;
  for (int i = 0; i < 200; ++i) idle.push_back(wire::connect_tcp("127.0.0.1", port, 30));
  EXPECT_TRUE(is_stopped(answer_to(port, "POST /stop ")));
  EXPECT_EQ(all_said_by(idle.front(), 30), "") << "the oldest is closed";
  say(idle.back(), "POST /stop ");
  EXPECT_TRUE(is_stopped(all_said_by(idle.back()))) << "the newest is kept";
}

TEST_F(StopPortTest, HalfARequestIsNotWaitedForLongerThanItsTime) {
  StopPortOptions options;
  options.patience_s = 0.2;
  const int port = open(options).port();
  const wire::Socket silent = wire::connect_tcp("127.0.0.1", port, 30), half = wire::connect_tcp("127.0.0.1", port, 30);
  say(half, "POST /sto");
  for (const wire::Socket* socket : {&silent, &half}) {
    ASSERT_TRUE(socket->readable(30));
    EXPECT_EQ(all_said_by(*socket), "");
  }
  EXPECT_EQ(stops(), 0);
}

TEST_F(StopPortTest, TakesNoMoreBytesThanItsLimit) {
  StopPortOptions options;
  options.patience_s = 600;
  const wire::Socket socket = wire::connect_tcp("127.0.0.1", open(options).port(), 30);
  bool closed = false;
  try {
    say(socket, "GET / HTTP/1.1\r\n");
    for (int i = 0; i < 1000; ++i) say(socket, std::string(1 << 16, 'x'));
  } catch (const wire::Disconnected&) { closed = true; }
  EXPECT_TRUE(closed);
}

TEST_F(StopPortTest, StopsWhenTheProcessHasNoFileDescriptorLeft) {
  const int port = open().port();
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  std::vector<wire::Socket> asked;  // a socket needs a descriptor on this side as well: had beforehand
  for (int i = 0; i < 3; ++i) asked.emplace_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  std::vector<wire::Socket> hoard;
  while (hoard.empty() || hoard.back().is_open()) {
    hoard.emplace_back(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    if (hoard.size() == 64)
      ::setrlimit(
          RLIMIT_NOFILE,
          std::make_unique<rlimit>(rlimit{static_cast<rlim_t>(hoard.back().descriptor() + 8), before.rlim_max}).get());
  }
  ASSERT_EQ(errno, EMFILE);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  int wanted = 0;
  for (const wire::Socket& socket : asked) {
    ASSERT_EQ(::connect(socket.descriptor(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    say(socket, "POST /stop ");
    EXPECT_TRUE(is_stopped(all_said_by(socket, 10)));
    EXPECT_EQ(stops(), ++wanted);
  }
  hoard.clear();
  ::setrlimit(RLIMIT_NOFILE, &before);
}

TEST_F(StopPortTest, DoesWhatWasAskedForBeforeItEnds) {
  const wire::Socket socket = wire::connect_tcp("127.0.0.1", open().port(), 30);
  held_ = 1;
  say(socket, "POST /stop ");
  ASSERT_TRUE(comes_true([&] { return stops() == 1; }));
  std::thread end([this] { port_.reset(); });
  release();
  end.join();
  EXPECT_TRUE(is_stopped(all_said_by(socket)));
}

class ConsoleStop : public ConsoleServer {};

TEST_F(ConsoleStop, ComesFromAnybodyWithAnyBodyAtBothPorts) {
  int wanted = 0;
  for (const std::string& body : {std::string(), std::string("{not json"), std::string(1 << 20, 'x')}) {
    for (const auto& [port, path] :
         {std::pair{server_->port(), "/api/stop"}, std::pair{server_->stop_port(), "/stop"}}) {
      rig_.armed = true;
      const std::string head = fmt::format(
          "POST {} HTTP/1.1\r\nHost: rebound.example\r\nOrigin: http://elsewhere.example\r\nX-Selvedge-Token: "
          "dead\r\nContent-Length: {}\r\n\r\n",
          path, body.size());
      const wire::Socket socket = wire::connect_tcp("127.0.0.1", port, 30);
      say(socket, head);
      std::string answer(512, ' ');
      ASSERT_TRUE(socket.readable(30)) << path << " waits for a body";
      answer.resize(socket.receive({reinterpret_cast<std::uint8_t*>(answer.data()), answer.size()}));
      EXPECT_TRUE(answer.starts_with("HTTP/1.1 200")) << answer;
      EXPECT_EQ(rig_.stops, ++wanted) << path << " " << body.size();
      EXPECT_FALSE(rig_.armed);
    }
  }
}

TEST_F(ConsoleStop, NamesThePeerInTheLog) {
  EXPECT_TRUE(is_stopped(answer_to(server_->stop_port(), "POST /stop ")));
  EXPECT_TRUE(comes_true([&] { return !log().empty(); }));
  const std::string line = log();
  EXPECT_NE(line.find(" 127.0.0.1:"), std::string::npos) << line;
  EXPECT_NE(line.find(" 200 stop"), std::string::npos) << line;
  EXPECT_NE(rig_.stopped_because.find("operator at the console, from 127.0.0.1:"), std::string::npos)
      << rig_.stopped_because;
}

TEST_F(ConsoleStop, IsNotSaidToBeDoneWhereItFailed) {
  rig_.does_not_stop = true;
  EXPECT_TRUE(answer_to(server_->stop_port(), "POST /stop ").starts_with("HTTP/1.1 500"));
  EXPECT_EQ(post("/api/stop", {}), 500);
  EXPECT_TRUE(logged("500 stop the arm has not said that it stopped")) << log();
}

TEST_F(ConsoleStop, ThePageKnowsItsStopPortAndMayConnectToIt) {
  const auto page = client_->Get("/");
  EXPECT_NE(page->body.find(std::to_string(server_->stop_port())), std::string::npos);
  const std::string policy = page->get_header_value("Content-Security-Policy");
  EXPECT_NE(
      policy.find(fmt::format("connect-src 'self' http://127.0.0.1:{0} http://localhost:{0};", server_->stop_port())),
      std::string::npos)
      << policy;
  std::string text;
  client_->Get("/api/events", [&](const char* data, size_t size) {
    text.append(data, size);
    return false;
  });
  EXPECT_NE(text.find(fmt::format("\"stop_port\":{}", server_->stop_port())), std::string::npos) << text;
}

TEST_F(ConsoleStop, HasThePortBesideTheConsolesOwnWhereThatIsFree) {
  const wire::Socket held = wire::listen_tcp("127.0.0.1", 0);
  const int taken = wire::local_port(held);
  ServerOptions options = options_;
  options.stop_port = taken;
  EXPECT_THROW(Server(options, rig_, *run_), BadInput);
  options.stop_port.reset();
  options.port = taken - 1;
  try {
    const Server beside(options, rig_, *run_);
    EXPECT_NE(beside.stop_port(), taken);
    EXPECT_TRUE(is_stopped(answer_to(beside.stop_port(), "POST /stop ")));
  } catch (const BadInput& error) {
    EXPECT_NE(std::string(error.what()).find("--port"), std::string::npos)
        << "only the port below may be another program's";
  }
  // A port that another program takes meanwhile is no fault: another pair is tried.
  bool beside = false;
  for (int i = 0; i < 20 && !beside; ++i) {
    options.port = 0;
    const Server server(options, rig_, *run_);
    beside = server.stop_port() == server.port() + 1;
  }
  EXPECT_TRUE(beside);
}

// How late this machine answers while the crowd keeps it busy: one byte there and back between two threads.
class Echo {
 public:
  Echo() {
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends_), 0);
    thread_ = std::thread([this] {
      char c;
      while (::read(ends_[1], &c, 1) == 1 && ::write(ends_[1], &c, 1) == 1) {}
    });
  }
  ~Echo() {
    ::shutdown(ends_[0], SHUT_RDWR);
    thread_.join();
    for (const int end : ends_) ::close(end);
  }
  double there_and_back_s() const {
    const auto begin = Clock::now();
    char c = 'x';
    EXPECT_EQ(::write(ends_[0], &c, 1), 1);
    EXPECT_EQ(::read(ends_[0], &c, 1), 1);
    return seconds_since(begin);
  }

 private:
  int ends_[2];
  std::thread thread_;
};

// A hundred streams and a hundred half-open requests at each port, all kept up; 100 ms are promised on a machine that
// does not itself keep a byte waiting: on a busy one its own delay comes on top.
TEST_F(ConsoleStop, ComesAtOnceThroughACrowdAtBothPorts) {
  need_descriptors(2048);
  const Crowd console(server_->port(), 100, 100), stop(server_->stop_port(), 100, 100);
  const Echo echo;
  std::vector<double> called_s, answered_s, echo_s;
  for (int i = 0; i < 100; ++i) {
    echo_s.push_back(echo.there_and_back_s());
    const int before = rig_.stops;
    const auto click = Clock::now();
    ASSERT_TRUE(is_stopped(
        answer_to(server_->stop_port(), "POST /stop HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 0\r\n\r\n")));
    answered_s.push_back(seconds_since(click));
    called_s.push_back(std::chrono::duration<double>(rig_.stopped_at.load() - click).count());
    EXPECT_EQ(rig_.stops, before + 1);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_GE(console.opened(), 200);
  EXPECT_GE(stop.opened(), 200);
  for (std::vector<double>* all : {&called_s, &answered_s, &echo_s}) std::sort(all->begin(), all->end());
  fmt::print(
      "click to RigLink::stop: median {:.2f} ms, worst of 100 {:.2f} ms; to the answer: {:.2f} ms, {:.2f} ms; a byte "
      "there and back: {:.2f} ms, {:.2f} ms\n",
      1e3 * called_s[50], 1e3 * called_s[99], 1e3 * answered_s[50], 1e3 * answered_s[99], 1e3 * echo_s[50],
      1e3 * echo_s[99]);
  EXPECT_LT(called_s[50], 0.1 + 20 * echo_s[50]);
  EXPECT_LT(called_s[99], 0.1 + 20 * echo_s[99]);
  EXPECT_LT(answered_s[50], 0.1 + 20 * echo_s[50]);
}

}  // namespace
}  // namespace selvedge::console
