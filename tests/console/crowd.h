// A crowd of connections that keeps a port busy, for tests: half of them ask for a stream of events and do not read it,
// half send half a request and wait. Whichever the server closes is opened again.
#pragma once

#include <poll.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "rig/wire/socket.h"

namespace selvedge::console {

inline void say(const wire::Socket& socket, const std::string& text) {
  socket.send({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, 30);
}

// All that comes until the peer closes, or nothing has come for the limit.
inline std::string all_said_by(const wire::Socket& socket, double limit_s = 30) {
  std::string text;
  std::vector<std::uint8_t> bytes(4096);
  try {
    while (socket.readable(limit_s)) text.append(reinterpret_cast<const char*>(bytes.data()), socket.receive(bytes));
  } catch (const wire::Disconnected&) {}
  return text;
}

class Crowd {
 public:
  Crowd(int port, int streams, int half_open) : port_(port) {
    for (int i = 0; i < streams; ++i)
      requests_.push_back("GET /api/events HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n\r\n");
    for (int i = 0; i < half_open; ++i)
      requests_.push_back(i % 2 == 0 ? "POST /sto" : "POST /api/stop HTTP/1.1\r\nContent-Len");
    connections_.resize(requests_.size());
    open_what_is_closed();
    thread_ = std::thread([this] {
      while (!ending_) {
        open_what_is_closed();
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
  }
  ~Crowd() {
    ending_ = true;
    thread_.join();
  }

  int opened() const { return opened_; }

 private:
  void open_what_is_closed() {
    for (size_t i = 0; i < connections_.size() && !ending_; ++i) {
      pollfd entry{connections_[i].descriptor(), POLLRDHUP, 0};
      if (connections_[i].is_open() && ::poll(&entry, 1, 0) == 0) continue;
      try {
        connections_[i] = wire::connect_tcp("127.0.0.1", port_, 30);
        say(connections_[i], requests_[i]);
        ++opened_;
      } catch (const std::exception&) {  // dropped at once; the next look opens it again
      }
    }
  }

  const int port_;
  std::vector<std::string> requests_;
  std::vector<wire::Socket> connections_;
  std::atomic<int> opened_{0};
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace selvedge::console
