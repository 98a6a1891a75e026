#include "cli/verify/proofs/console_run.h"

#include <atomic>
#include <chrono>
#include <filesystem>
#include <mutex>
#include <thread>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <selvedge_rig/preview_t.hpp>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "capture/session/run_trial.h"
#include "console/bus_rig_link.h"
#include "console/gate.h"
#include "console/server.h"
#include "files/shared_files.h"
#include "files/whole_file.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "station/simulated_rig.h"

namespace selvedge::cli {

namespace {

namespace fs = std::filesystem;

double cpu_s() {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  return static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

double cores_over(double seconds) {
  const double cpu = cpu_s(), begin = rig::host_now_s();
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  return (cpu_s() - cpu) / (rig::host_now_s() - begin);
}

class Latencies {
 public:
  void take(int64_t utime) {
    const std::lock_guard lock(mutex_);
    seconds_.push_back(rig::host_now_s() - 1e-6 * static_cast<double>(utime));
  }
  std::vector<double> seconds() const {
    const std::lock_guard lock(mutex_);
    return seconds_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<double> seconds_;
};

// A page as the server sees it: reads the events, and the moment in which a picture arrives.
void read_events(int port, const std::atomic<bool>& ending, Latencies& latencies) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<uint16_t>(port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(socket, reinterpret_cast<sockaddr*>(&to), sizeof to) != 0)
    throw std::runtime_error("the console does not answer");
  const timeval patience{1, 0};
  ::setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  const std::string request = fmt::format("GET /api/events HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n", port);
  [[maybe_unused]] const ssize_t sent = ::send(socket, request.data(), request.size(), 0);
  std::string text;
  std::vector<char> buffer(1 << 16);
  const std::string mark = "\"utime\":";
  while (!ending) {
    const ssize_t count = ::recv(socket, buffer.data(), buffer.size(), 0);
    if (count <= 0) continue;
    text.append(buffer.data(), static_cast<size_t>(count));
    for (size_t at; (at = text.find(mark)) != std::string::npos && text.find("\n\n", at) != std::string::npos;) {
      latencies.take(std::stoll(text.substr(at + mark.size(), 20)));
      text.erase(0, text.find("\n\n", at));
    }
    if (text.size() > (1 << 20)) text.clear();
  }
  ::close(socket);
}

geometry::Projection projection_of(const nlohmann::json& json) {
  geometry::Projection p;
  p.width_px = json.at("width_px");
  p.height_px = json.at("height_px");
  for (size_t r = 0; r < 3; ++r)
    for (size_t c = 0; c < 4; ++c)
      p.matrix(static_cast<int>(r), static_cast<int>(c)) = json.at("projection").at(r).at(c);
  p.distortion = json.at("distortion").get<std::array<double, 5>>();
  return p;
}

}  // namespace

ConsoleRun run_console_with_pages(double seconds, const report::ProgressCallback& progress) {
  const fs::path source = files::shared_folder(),
                 folder = fs::temp_directory_path() / fmt::format("selvedge-console-run-{}", ::getpid());
  fs::create_directories(folder);
  ConsoleRun out;
  {
    station::SimulatedRig rig(
        {source / "examples" / "demo-rig.toml", source / "examples" / "demo-world.toml", source / "data" / "arms"},
        folder);
    session::RigClient client(rig.configuration());
    client.wait_until_running(120, [&](const std::string& missing) {
      rig.require_running();
      progress(0.8, missing);
    });
    session::SessionPlan plan = session::read_session_plan(rig.configuration());
    const nlohmann::json truth = files::read_json(folder / "truth.json");
    const session::RigOptics optics{projection_of(truth.at("camera")), projection_of(truth.at("projector"))};
    client.show(plan.stripes);

    Latencies bus_latencies, page_latencies;
    rig::Bus bus(rig.configuration().bus());
    bus.subscribe<selvedge_rig::preview_t>(
        rig::channel("camera", rig::kPreview),
        [&](const selvedge_rig::preview_t& preview) { bus_latencies.take(preview.utime); });
    bus.start();
    console::ServerOptions options;
    options.token = console::random_token();
    const console::RunFolder run(folder);
    console::BusRigLink link({folder / "rig.toml", folder / "calibration.json", folder / "console"});
    const console::Server server(options, link, run);
    progress(0.82, "the console without a page");
    out.idle_cores = cores_over(seconds);
    const std::vector<double> alone = bus_latencies.seconds();
    out.bus_latency_s = alone.empty() ? 0 : median(alone);

    progress(0.84, "the console with four pages");
    std::atomic<bool> ending{false};
    std::vector<std::thread> pages;
    for (int i = 0; i < 4; ++i) pages.emplace_back([&] { read_events(server.port(), ending, page_latencies); });
    out.open_cores = cores_over(seconds);
    session::TrialPlan trial = plan.trials.front();
    trial.duration_s = seconds;
    try {
      const session::TrialRecord record = session::run_trial(client, rig.configuration(), plan, trial, optics,
                                                             folder / "trials", [](double, const std::string&) {});
      out.frames = static_cast<int64_t>(record.frames);
      out.frames_lost = record.frames_lost;
    } catch (...) {
      ending = true;
      for (std::thread& page : pages) page.join();
      throw;
    }
    ending = true;
    for (std::thread& page : pages) page.join();
    const std::vector<double> seen = page_latencies.seconds();
    out.previews = seen.size();
    out.page_latency_s = seen.empty() ? 0 : median(seen);
  }
  fs::remove_all(folder);
  return out;
}

}  // namespace selvedge::cli
