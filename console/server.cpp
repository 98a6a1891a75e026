#include "console/server.h"

#include <chrono>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "console/gate.h"
#include "console/page_watch.h"
#include "console/request_log.h"
#include "console/requests.h"
#include "console/stop_port.h"
#include "files/bad_input.h"
#include "files/whole_file.h"
#include "report/base64.h"

#include <httplib.h>  // behind Eigen: what it includes has a macro _res

namespace selvedge::console {

namespace {

namespace fs = std::filesystem;
using httplib::Request;
using httplib::Response;
using nlohmann::json;

constexpr size_t kThreads = 32;     // each page holds one for its events
constexpr int kPages = 16;          // that may do so at once; the rest of the threads is for requests
constexpr int kHalfARequest_s = 2;  // until the rest of it must have come
constexpr size_t kLargestRequest = 1 << 16;
constexpr const char* kStopPortMark = "{{stop-port}}";  // in index.html

const char* type_of(const fs::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".html") return "text/html; charset=utf-8";
  if (extension == ".js") return "text/javascript; charset=utf-8";
  if (extension == ".css") return "text/css; charset=utf-8";
  if (extension == ".json" || extension == ".map") return "application/json";
  if (extension == ".svg") return "image/svg+xml";
  if (extension == ".png") return "image/png";
  return "text/plain; charset=utf-8";
}

void answer(Response& response, const json& value, int status = 200) {
  response.status = status;
  response.set_content(value.dump(-1, ' ', false, json::error_handler_t::replace), "application/json");
}

std::string event(const char* name, const std::string& data) {
  return fmt::format("event: {}\ndata: {}\n\n", name, data);
}

size_t index_of(const Request& request) { return frame_index_of(request.get_param_value("index")); }

constexpr const char* kNotBuilt =
    "<!DOCTYPE html><meta charset=utf-8><title>Selvedge</title><body style=\"font:16px "
    "sans-serif;max-width:40em;margin:3em auto\">"
    "<h1>The console's page is not built</h1><p>Its libraries come from npm. Run <code>./selvedge console</code> once "
    "where the npm registry can be reached; "
    "from then on it works without a network.</p>";

}  // namespace

struct Server::Impl {
  Impl(const ServerOptions& o, RigLink& l, const RunFolder& r)
      : options(o), link(l), run(r), log(o.log),
        watch(l, o.page_bound_s, [this](const std::string& why) { log.add("-", "stop", why, 200); }) {
    server.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
    server.set_keep_alive_timeout(2);
    server.set_read_timeout(kHalfARequest_s);
    server.set_payload_max_length(kLargestRequest);
    server.set_tcp_nodelay(true);
    const int bound = o.port == 0                                   ? server.bind_to_any_port(o.bind.c_str())
                      : server.bind_to_port(o.bind.c_str(), o.port) ? o.port
                                                                    : -1;
    if (bound <= 0)
      refuse(fmt::format("--bind {} --port {}", o.bind, o.port),
             "the address cannot be had: another program has it, or this host does not have it");
    port = bound;
    open_stop_port();
    std::vector<std::string> names = {o.bind}, hosts;
    if (o.bind == "127.0.0.1") names.push_back("localhost");
    // The page may also connect to its stop port, which is another origin.
    std::string stop_origins;
    for (const std::string& name : names) {
      hosts.push_back(fmt::format("{}:{}", name, port));
      stop_origins += fmt::format(" http://{}:{}", name, stop_port->port());
    }
    server.set_default_headers(
        {{"X-Content-Type-Options", "nosniff"},
         {"Referrer-Policy", "no-referrer"},
         {"Cache-Control", "no-store"},
         {"Content-Security-Policy",
          "default-src 'self'; connect-src 'self'" + stop_origins +
              "; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; script-src 'self'; "
              "frame-ancestors 'self'; base-uri 'none'; form-action 'none'"}});
    gate = std::make_unique<Gate>(hosts, o.token);
    route();
    thread = std::thread([this] { server.listen_after_bind(); });
    while (!server.is_running())
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // what does not run yet cannot be stopped
  }

  ~Impl() {
    ending = true;
    server.stop();
    thread.join();
  }

  // A page of before a restart finds the port where it was: it is the one beside the console's own where that is free.
  void open_stop_port() {
    const auto open = [this](int wanted) {
      stop_port = std::make_unique<StopPort>(StopPortOptions{options.bind, wanted},
                                             [this](const std::string& peer) { stop(peer); });
    };
    if (options.stop_port) return open(*options.stop_port);
    try {
      if (port < 65535) return open(port + 1);
    } catch (const BadInput&) {  // another program has it
    }
    open(0);
  }

  // On anybody's word: a stop too many is harmless, one that is refused is not.
  void stop(const std::string& peer) {
    try {
      link.stop("stopped by an operator at the console, from " + peer);
    } catch (const std::exception& error) {
      log.add(peer, "stop", error.what(), 500);
      throw;
    }
    watch.disarmed();
    log.add(peer, "stop", "", 200);
  }

  // The page's own stop at the console's port: for where the stop port cannot be reached.
  void stop(const Request& request, Response& response) {
    response.set_header("Connection", "close");  // a body may follow, which nobody reads
    try {
      stop(fmt::format("{}:{}", request.remote_addr, request.remote_port));
      answer(response, {{"stopped", true}});
    } catch (const std::exception& error) { answer(response, {{"error", error.what()}}, 500); }
  }

  // Every request passes here first, before its body is read. A stop needs nothing to be let in.
  httplib::Server::HandlerResponse let_in(const Request& request, Response& response) {
    if (request.method == "POST" && request.path == "/api/stop") {
      stop(request, response);
      return httplib::Server::HandlerResponse::Handled;
    }
    const auto why =
        gate->refusal(Asked{request.method, request.path, request.get_header_value("Host"),
                            request.get_header_value("Origin"), request.get_header_value("X-Selvedge-Token")});
    if (!why) return httplib::Server::HandlerResponse::Unhandled;
    log.add(request.remote_addr, request.method + " " + request.path, *why, 403);
    answer(response, {{"error", *why}}, 403);
    return httplib::Server::HandlerResponse::Handled;
  }

  template <class Handler>
  httplib::Server::Handler get(Handler handler) {
    return [handler](const Request& request, Response& response) {
      try {
        handler(request, response);
      } catch (const BadInput& error) {
        answer(response, {{"error", error.what()}}, 404);
      } catch (const std::exception& error) { answer(response, {{"error", error.what()}}, 500); }
    };
  }

  // Of a request that changes something: logged with what came of it.
  template <class Handler>
  void post(const std::string& path, Handler handler) {
    server.Post(path, [this, path, handler](const Request& request, Response& response) {
      const std::string page = request.get_header_value("X-Selvedge-Page");
      try {
        handler(page, read_body(request.body));
        answer(response, {{"ok", true}});
      } catch (const BadInput& error) {
        answer(response, {{"error", error.what()}}, 400);
      } catch (const std::exception& error) { answer(response, {{"error", error.what()}}, 409); }
      watch.heard(page);
      log.add(request.remote_addr, path, response.status == 200 ? request.body : request.body + " " + response.body,
              response.status);
    });
  }

  void route() {
    server.set_pre_routing_handler(
        [this](const Request& request, Response& response) { return let_in(request, response); });
    server.Get("/", get([this](const Request&, Response& response) {
                 response.set_content(fs::exists(options.web / "app.js") ? page_text() : kNotBuilt,
                                      "text/html; charset=utf-8");
               }));
    server.Get("/api/session", get([this](const Request&, Response& response) { answer(response, run.session()); }));
    server.Get("/api/trials", get([this](const Request&, Response& response) { answer(response, run.trials()); }));
    server.Get("/api/trial", get([this](const Request& request, Response& response) {
                 answer(response, run.trial(request.get_param_value("path")));
               }));
    server.Get("/api/frame", get([this](const Request& request, Response& response) {
                 response.set_content(run.frame(request.get_param_value("path"), index_of(request)), "image/png");
               }));
    server.Get("/api/simulated", get([this](const Request& request, Response& response) {
                 response.set_content(run.simulated_frame(request.get_param_value("path"), index_of(request)),
                                      "image/png");
               }));
    server.Get("/api/motion", get([this](const Request& request, Response& response) {
                 response.set_content(run.motion(request.get_param_value("path")), "application/octet-stream");
               }));
    server.Get("/api/events", [this](const Request&, Response& response) { stream(response); });
    server.Get("/run/(.*)", get([this](const Request& request, Response& response) {
                 const auto file = run.shown_file(request.matches[1]);
                 if (!file) return answer(response, {{"error", "no such file of this run"}}, 404);
                 response.set_content(files::read_whole(*file), type_of(*file));
               }));
    server.Get("/(.*)", get([this](const Request& request, Response& response) {
                 const auto file = file_below(options.web, request.matches[1]);
                 if (!file) return answer(response, {{"error", "no such page"}}, 404);
                 response.set_content(files::read_whole(*file), type_of(*file));
               }));
    server.Post("/api/heartbeat", [this](const Request& request, Response& response) {
      watch.heard(request.get_header_value("X-Selvedge-Page"));
      answer(response, {{"ok", true}});
    });
    post("/api/arm", [this](const std::string& page, const json&) {
      if (page.empty()) refuse("X-Selvedge-Page", "missing: who arms must be heard of later");
      watch.armed_by(page);  // before it is armed: a page that goes meanwhile is noticed
      try {
        link.arm("armed by an operator at the console");
      } catch (...) {
        watch.disarmed();
        throw;
      }
      if (!watch.waits_for(page)) {
        link.stop("the page that armed the arm went away meanwhile");
        throw std::runtime_error("the page went away while the arm was being armed");
      }
    });
    post("/api/disarm", [this](const std::string&, const json&) {
      watch.disarmed();
      link.disarm();
    });
    post("/api/reset", [this](const std::string&, const json&) { link.reset("reset by an operator at the console"); });
    post("/api/record", [this](const std::string&, const json& body) { link.record(body); });
    post("/api/record/stop", [this](const std::string&, const json&) { link.stop_recording(); });
    post("/api/answer", [this](const std::string&, const json& body) {
      const PromptAnswer given = prompt_answer_of(body);
      link.answer(given.prompt, given.text);
    });
  }

  std::string page_text() const {
    std::string text = files::read_whole(options.web / "index.html");
    if (const size_t at = text.find(kStopPortMark); at != std::string::npos)
      text.replace(at, std::string(kStopPortMark).size(), std::to_string(stop_port->port()));
    return text;
  }

  void stream(Response& response) {
    if (++listening > kPages) {
      --listening;
      return answer(response, {{"error", fmt::format("{} pages listen already", kPages)}}, 503);
    }
    auto shown = std::make_shared<int64_t>(-1);
    auto next = std::make_shared<std::chrono::steady_clock::time_point>(std::chrono::steady_clock::now());
    response.set_header("X-Accel-Buffering", "no");
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, shown, next](size_t, httplib::DataSink& sink) {
      if (ending || !sink.is_writable()) return false;
      std::this_thread::sleep_until(*next);
      *next = std::chrono::steady_clock::now() +
              std::chrono::microseconds(static_cast<int64_t>(1e6 / options.state_rate_hz));
      link.watched();
      json state = link.state();
      state["stop_port"] = stop_port->port();
      std::string text = event("state", state.dump(-1, ' ', false, json::error_handler_t::replace));
      if (const auto preview = link.preview(*shown)) {
        *shown = preview->number;
        text += event("preview",
                      fmt::format("{{\"number\":{},\"utime\":{},\"png\":\"{}\",\"overlay\":{}}}", preview->number,
                                  preview->utime, report::base64(preview->png), preview->overlay));
      }
      return sink.write(text.data(), text.size());
        },
        [this](bool) { --listening; });
  }

  const ServerOptions options;
  RigLink& link;
  const RunFolder& run;
  RequestLog log;
  std::unique_ptr<Gate> gate;
  PageWatch watch;
  std::atomic<bool> ending{false};
  std::atomic<int> listening{0};
  int port = 0;
  std::unique_ptr<StopPort> stop_port;
  httplib::Server server;
  std::thread thread;
};

Server::Server(const ServerOptions& options, RigLink& link, const RunFolder& run)
    : impl_(std::make_unique<Impl>(options, link, run)) {}
Server::~Server() = default;
int Server::port() const { return impl_->port; }
int Server::stop_port() const { return impl_->stop_port->port(); }
std::string Server::url() const {
  return fmt::format("http://{}:{}/#token={}", impl_->options.bind, impl_->port, impl_->options.token);
}
int Server::listeners() const { return impl_->listening; }

}  // namespace selvedge::console
