#include "console/stop_port.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "files/bad_input.h"
#include "rig/wire/socket.h"

namespace selvedge::console {

namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;

constexpr int kLook_ms = 250;   // between looks at what has waited too long
constexpr int kWaiting = 1024;  // connections that the kernel keeps until they are taken, where it allows so many
constexpr size_t kLongestLine = 2048;  // of a request; what it asks for stands in its first bytes

constexpr const char* kPage =
    "<!DOCTYPE html><meta charset=utf-8><title>Selvedge: stop</title>"
    "<body style=\"font:16px sans-serif;max-width:40em;margin:3em auto\">"
    "<h1>The stop of a Selvedge console</h1><p>This port stops the arm, and does nothing else. Whoever reaches it may. "
    "It is no emergency stop: that one is on the arm's own pendant.</p>"
    "<form method=post action=/stop>"
    "<button style=\"font-size:2em;padding:1em 2em;background:#c22;color:#fff\">STOP</button></form>"
    "<p>From a program: <code>POST /stop</code>; the answer comes when the arm has stopped.</p>";

std::string answer_text(const char* status, const char* type, const std::string& body) {
  return fmt::format(
      "HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n"
      "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n"
      "Access-Control-Allow-Origin: *\r\nAccess-Control-Allow-Methods: POST\r\nAccess-Control-Allow-Headers: *\r\n"
      "Content-Security-Policy: default-src 'none'; style-src 'unsafe-inline'; form-action 'self'\r\n\r\n{}",
      status, type, body.size(), body);
}

// Empty where the stop was done.
std::string answer_of_stop(const std::string& error) {
  const json body = error.empty() ? json{{"stopped", true}} : json{{"error", error}};
  return answer_text(error.empty() ? "200 OK" : "500 Internal Server Error", "application/json",
                     body.dump(-1, ' ', false, json::error_handler_t::replace));
}

enum class Request { not_yet, stop, other };

// By the first bytes alone: nothing that follows can make a stop another thing.
Request request_in(std::string_view received) {
  received.remove_prefix(std::min(received.find_first_not_of("\r\n"), received.size()));
  constexpr std::string_view stop = "POST /stop";
  if (received.substr(0, stop.size()) == stop && received.size() > stop.size() &&
      std::string_view(" ?\r\n").find(received[stop.size()]) != std::string_view::npos)
    return Request::stop;
  return received.find('\n') != std::string_view::npos || received.size() >= kLongestLine ? Request::other
                                                                                          : Request::not_yet;
}

std::string answer_to_other(std::string_view received) {
  received.remove_prefix(std::min(received.find_first_not_of("\r\n"), received.size()));
  if (received.starts_with("GET ") || received.starts_with("HEAD "))
    return answer_text("200 OK", "text/html; charset=utf-8", kPage);
  if (received.starts_with("OPTIONS ")) return answer_text("200 OK", "text/plain", "");
  return answer_text("404 Not Found", "text/plain", "This port knows POST /stop.\n");
}

struct Connection {
  enum class Stage { asking, stopping, answered };
  uint64_t id = 0;
  wire::Socket socket;
  std::string peer;
  Stage stage = Stage::asking;
  Clock::time_point since;  // of its stage
  std::string received;     // the first bytes
  size_t bytes = 0;         // read in all
  bool silent = false;      // its sender will send no more
};

}  // namespace

struct StopPort::Impl {
  Impl(const StopPortOptions& o, Stop s) : options(o), stop(std::move(s)) {
    try {
      listener = wire::listen_tcp(o.bind, o.port);
    } catch (const std::exception& error) {
      refuse(fmt::format("--bind {} --stop-port {}", o.bind, o.port), "the address cannot be had: {}", error.what());
    }
    ::listen(listener.descriptor(), kWaiting);
    ::fcntl(listener.descriptor(), F_SETFL, O_NONBLOCK);
    wake = wire::Socket(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    nothing = wire::Socket(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    for (int i = 0; i < o.connections; ++i) spare.emplace_back(::fcntl(nothing.descriptor(), F_DUPFD_CLOEXEC, 0));
    if (!wake.is_open() || !nothing.is_open() || !spare.back().is_open())
      throw std::runtime_error("the console's stop port: no file descriptors are left");
    for (int i = 0; i < o.doers; ++i) doers.emplace_back([this] { do_stops(); });
    mover = std::thread([this] { move_bytes(); });
  }

  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      no_more_stops = true;
    }
    waiting.notify_all();
    for (std::thread& doer : doers) doer.join();
    {
      const std::lock_guard lock(mutex);
      ending = true;
    }
    ring();
    mover.join();
  }

  void ring() {
    const uint64_t one = 1;
    [[maybe_unused]] const ssize_t written =
        ::write(wake.descriptor(), &one, sizeof one);  // fails where it rings already
  }

  // A doer's work. Whoever asked while all doers were busy is answered by the same stop, which begins after they asked.
  void do_stops() {
    for (;;) {
      std::vector<uint64_t> ids;
      std::string peer;
      {
        std::unique_lock lock(mutex);
        waiting.wait(lock, [this] { return !wanted.empty() || no_more_stops; });
        if (wanted.empty()) return;
        ids = std::exchange(wanted, {});
        peer = ids.size() == 1 ? wanted_by : fmt::format("{} and {} more", wanted_by, ids.size() - 1);
      }
      std::string error;
      try {
        stop(peer);
      } catch (const std::exception& problem) {
        error = std::string(problem.what()).empty() ? "the stop failed" : problem.what();
      }
      {
        const std::lock_guard lock(mutex);
        done.emplace_back(std::move(ids), std::move(error));
      }
      ring();
    }
  }

  // The mover's work: who asks, who has been answered, who has waited too long.
  void move_bytes() {
    for (;;) {
      std::vector<pollfd> watched = {{wake.descriptor(), POLLIN, 0}, {listener.descriptor(), POLLIN, 0}};
      for (const Connection& c : connections) watched.push_back({c.silent ? -1 : c.socket.descriptor(), POLLIN, 0});
      ::poll(watched.data(), watched.size(), connections.empty() ? -1 : kLook_ms);
      answer_what_is_done();
      {
        const std::lock_guard lock(mutex);
        if (ending) return;
      }
      for (size_t i = 0; i + 2 < watched.size(); ++i)
        if (watched[i + 2].revents != 0) read(connections[i]);
      drop_if([this](const Connection& c) { return gone_or_too_late(c); });
      if (watched[1].revents != 0) take_connections();
    }
  }

  bool gone_or_too_late(const Connection& c) const {
    if (c.stage == Connection::Stage::stopping) return false;
    return c.silent || c.bytes > options.largest_request ||
           Clock::now() - c.since > std::chrono::duration<double>(options.patience_s);
  }

  // As many as there is room for; the rest next time, when those who ask for something have been heard.
  void take_connections() {
    for (int taken = 0; taken < options.connections; ++taken) {
      sockaddr_in from{};
      socklen_t size = sizeof from;
      int descriptor =
          ::accept4(listener.descriptor(), reinterpret_cast<sockaddr*>(&from), &size, SOCK_NONBLOCK | SOCK_CLOEXEC);
      // The process has no descriptor left: this port has put some aside.
      while (descriptor < 0 && (errno == EMFILE || errno == ENFILE)) {
        if (spare.empty()) make_room();
        if (spare.empty()) break;
        spare.pop_back();
        descriptor =
            ::accept4(listener.descriptor(), reinterpret_cast<sockaddr*>(&from), &size, SOCK_NONBLOCK | SOCK_CLOEXEC);
      }
      if (descriptor < 0 && errno == ECONNABORTED) continue;
      if (descriptor < 0) break;
      if (static_cast<int>(connections.size()) >= options.connections) make_room();
      char address[INET_ADDRSTRLEN] = "?";
      ::inet_ntop(AF_INET, &from.sin_addr, address, sizeof address);
      Connection fresh;
      fresh.id = ++last_id;
      fresh.socket = wire::Socket(descriptor);
      fresh.peer = fmt::format("{}:{}", address, ntohs(from.sin_port));
      fresh.since = Clock::now();
      connections.push_back(std::move(fresh));
      read(connections.back());  // most have sent all by now
    }
  }

  // Drops whom it harms least, the oldest first. Whether it dropped one.
  bool make_room() {
    for (const auto stage : {Connection::Stage::answered, Connection::Stage::asking, Connection::Stage::stopping}) {
      const auto oldest =
          std::find_if(connections.begin(), connections.end(), [&](const Connection& c) { return c.stage == stage; });
      if (oldest == connections.end()) continue;
      put_aside(std::move(oldest->socket));
      connections.erase(oldest);
      return true;
    }
    return false;
  }

  template <class Condition>
  void drop_if(Condition condition) {
    for (Connection& c : connections)
      if (condition(c)) put_aside(std::move(c.socket));
    connections.erase(
        std::remove_if(connections.begin(), connections.end(), [](const Connection& c) { return !c.socket.is_open(); }),
        connections.end());
  }

  // Closes a connection, and keeps its descriptor where some of those put aside are in use.
  void put_aside(wire::Socket socket) {
    if (static_cast<int>(spare.size()) < options.connections &&
        ::dup3(nothing.descriptor(), socket.descriptor(), O_CLOEXEC) >= 0)
      spare.push_back(std::move(socket));
  }

  void read(Connection& c) {
    char bytes[4096];
    const ssize_t count = ::recv(c.socket.descriptor(), bytes, sizeof bytes, 0);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (count <= 0) {
      c.silent = true;
      return;
    }
    c.bytes += static_cast<size_t>(count);
    if (c.stage != Connection::Stage::asking) return;  // what follows a request is thrown away
    c.received.append(bytes, static_cast<size_t>(count));
    const Request request = request_in(c.received);
    if (request == Request::stop) want_stop(c);
    if (request == Request::other) answer(c, answer_to_other(c.received));
  }

  void want_stop(Connection& c) {
    c.stage = Connection::Stage::stopping;
    {
      const std::lock_guard lock(mutex);
      if (wanted.empty()) wanted_by = c.peer;
      if (static_cast<int>(wanted.size()) == options.connections)
        wanted.erase(wanted.begin());  // it was dropped long ago
      wanted.push_back(c.id);
    }
    waiting.notify_one();
  }

  void answer_what_is_done() {
    uint64_t rung = 0;
    [[maybe_unused]] const ssize_t count = ::read(wake.descriptor(), &rung, sizeof rung);
    std::vector<std::pair<std::vector<uint64_t>, std::string>> ready;
    {
      const std::lock_guard lock(mutex);
      ready.swap(done);
    }
    for (const auto& [ids, error] : ready)
      for (Connection& c : connections)
        if (std::find(ids.begin(), ids.end(), c.id) != ids.end()) answer(c, answer_of_stop(error));
  }

  // The kernel takes an answer whole: it is short, and the first that is sent. The sender then closes, or its time
  // runs out: a connection closed with bytes unread would take the answer with it.
  void answer(Connection& c, const std::string& text) {
    ::send(c.socket.descriptor(), text.data(), text.size(), MSG_NOSIGNAL);
    ::shutdown(c.socket.descriptor(), SHUT_WR);
    c.stage = Connection::Stage::answered;
    c.since = Clock::now();
  }

  const StopPortOptions options;
  const Stop stop;
  wire::Socket listener, wake, nothing;
  std::vector<wire::Socket> spare;      // descriptors put aside; the mover's alone, as are the next two
  std::vector<Connection> connections;  // the oldest first
  uint64_t last_id = 0;
  std::mutex mutex;  // of all down to ending
  std::condition_variable waiting;
  std::vector<uint64_t> wanted;  // connections that wait for a stop that has not begun
  std::string wanted_by;         // the first of them
  std::vector<std::pair<std::vector<uint64_t>, std::string>> done;  // connections, and what went wrong
  bool no_more_stops = false, ending = false;
  std::vector<std::thread> doers;
  std::thread mover;
};

StopPort::StopPort(const StopPortOptions& options, Stop stop)
    : impl_(std::make_unique<Impl>(options, std::move(stop))) {}
StopPort::~StopPort() = default;
int StopPort::port() const { return wire::local_port(impl_->listener); }

}  // namespace selvedge::console
