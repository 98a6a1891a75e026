// A port that does one thing: whoever sends it "POST /stop" stops the arm. It has its own socket and its own threads,
// so that nothing that happens to the console's pages can keep a stop waiting.
//
//   POST /stop   acts once these bytes have arrived, whatever follows them: neither token, host, origin nor body matter
//   GET  /       says what this is, with a button; OPTIONS: pages of any address may send the stop
// The answer comes when the stop has been done: 200 {"stopped": true}, or 500 {"error": …} with what went wrong.
//
// One thread moves bytes and never waits for anybody: it polls sockets that do not block. A few others do the stops;
// requests that come while all of them are busy share the next one. A connection has its limits in bytes, in time, and
// in number: with all taken, the oldest that has not asked for a stop makes room for a new one. Each connection's file
// descriptor is put aside at the start, so that a process with none left can still be asked. Source of what is
// answered: RFC 9112 (HTTP/1.1), and the Fetch standard for Access-Control-Allow-Origin.
#pragma once

#include <functional>
#include <memory>
#include <string>

namespace selvedge::console {

struct StopPortOptions {
  std::string bind = "127.0.0.1";
  int port = 0;                      // 0: any that is free
  int connections = 64;              // at once
  size_t largest_request = 1 << 16;  // bytes that are taken of a connection, most of them thrown away
  double patience_s = 5;             // for a request to arrive, and for its sender to take the answer
  int doers = 4;                     // stops at once
};

class StopPort {
 public:
  // Stops what is to be stopped, on the word of this peer ("127.0.0.1:41234"); throws where that failed. Called from
  // several threads at once.
  using Stop = std::function<void(const std::string& peer)>;

  // Throws BadInput where the address cannot be had.
  StopPort(const StopPortOptions& options, Stop stop);
  ~StopPort();  // what was asked for is done first
  StopPort(const StopPort&) = delete;
  StopPort& operator=(const StopPort&) = delete;

  int port() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace selvedge::console
