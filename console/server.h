// The console's web server: pages, live state as server-sent events, and the few requests that change something.
//
//   GET  /                     the page (built from console/web/ by ./selvedge)
//   GET  /api/events           events "state" (ten times a second) and "preview" (whenever there is a new one)
//   GET  /api/session, /api/trials, /api/trial?path=, /api/frame?path=&index=, /api/simulated?path=&index=,
//   /api/motion?path= GET  /run/PATH             a report or a data file of the run POST /api/heartbeat, /api/arm,
//   /api/disarm, /api/reset, /api/record, /api/record/stop, /api/answer POST /api/stop             from anybody,
//   whatever its body; the same as POST /stop of the stop port (stop_port.h),
//                              which works where this server's threads are all taken
// Every other POST needs the header X-Selvedge-Token; X-Selvedge-Page names the page (page_watch.h). Who is let in:
// gate.h. Every POST but the heartbeat, and every refusal, is a line of the log file (request_log.h).
// Source of the event stream: HTML Living Standard, server-sent events.
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "console/rig_link.h"
#include "console/run_folder.h"

namespace selvedge::console {

struct ServerOptions {
  std::string bind = "127.0.0.1";
  int port = 0;                  // 0: any that is free
  std::optional<int> stop_port;  // 0: any that is free; none: port + 1, or any that is free
  std::string token;
  std::filesystem::path web;  // folder with index.html and app.js
  std::filesystem::path log;
  double page_bound_s = 2;  // page_watch.h
  double state_rate_hz = 10;
};

class Server {
 public:
  // Throws BadInput where the address cannot be had.
  Server(const ServerOptions& options, RigLink& link, const RunFolder& run);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  int port() const;
  int stop_port() const;
  // "http://127.0.0.1:8080/#token=…"
  std::string url() const;
  // Pages that listen to events now.
  int listeners() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace selvedge::console
