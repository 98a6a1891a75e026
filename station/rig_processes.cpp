#include "station/rig_processes.h"

#include <chrono>
#include <csignal>
#include <fstream>
#include <map>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "files/bad_input.h"
#include "files/whole_file.h"
#include "rig/bus.h"
#include "rig/channels.h"
#include "rig/clock.h"
#include "rig/configuration.h"
#include "rig/network.h"
#include "station/child_process.h"
#include "station/programs.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;
constexpr double kPatience_s = 10;

fs::path state_folder(const fs::path& configuration) { return fs::path(configuration).replace_extension(".rig"); }

std::vector<std::string> arguments_of_daemon(const std::string& kind, const fs::path& configuration) {
  return {"daemon", kind, "--config", fs::absolute(configuration).lexically_normal().string()};
}

// Arguments of a running process, NUL-separated as the kernel keeps them; empty where there is none.
std::string arguments_of(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/cmdline", pid), std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// As the kernel keeps them behind the program's path, which moves when the program is built anew.
std::string joined(const std::vector<std::string>& arguments) {
  std::string text;
  for (const std::string& argument : arguments) text += std::string(1, '\0') + argument;
  return text + '\0';
}

std::optional<pid_t> running_pid(const std::string& kind, const fs::path& configuration) {
  std::ifstream file(state_folder(configuration) / (kind + ".pid"));
  pid_t pid = 0;
  if (!(file >> pid) || pid <= 1) return std::nullopt;
  const std::string arguments = arguments_of(pid);
  if (!arguments.ends_with(joined(arguments_of_daemon(kind, configuration)))) return std::nullopt;
  return pid;
}

std::map<std::string, selvedge_rig::device_status_t> listen(const fs::path& configuration,
                                                            const std::vector<std::string>& kinds, double listen_s) {
  std::mutex mutex;
  std::map<std::string, selvedge_rig::device_status_t> heard;
  rig::Bus bus(rig::Configuration::load(configuration).bus());
  for (const std::string& kind : kinds)
    bus.subscribe<selvedge_rig::device_status_t>(rig::channel(kind, rig::kStatus),
                                                 [&mutex, &heard, kind](const auto& message) {
      const std::lock_guard lock(mutex);
      heard[kind] = message;
    });
  const double until_s = rig::host_now_s() + listen_s;
  while (rig::host_now_s() < until_s) {
    bus.handle(0.1);
    const std::lock_guard lock(mutex);
    if (heard.size() == kinds.size()) break;
  }
  return heard;
}

}  // namespace

std::vector<std::string> daemon_kinds(const fs::path& configuration) {
  const auto loaded = rig::Configuration::load(configuration);
  std::vector<std::string> kinds;
  for (const char* kind : {"projector", "tracker", "camera", "arm"})
    if (loaded.has(kind)) kinds.emplace_back(kind);
  if (kinds.empty())
    refuse(configuration.string(), "no section [camera], [tracker], [projector] or [arm]: no daemon to run");
  return kinds;
}

std::vector<DaemonState> rig_up(const fs::path& configuration) {
  const auto kinds = daemon_kinds(configuration);
  const int port = rig::Configuration::load(configuration).bus().port;
  if (!rig::multicast_works(static_cast<uint16_t>(port))) throw BadInput(rig::multicast_advice());
  const fs::path folder = state_folder(configuration);
  fs::create_directories(folder);
  for (const std::string& kind : kinds) {
    if (running_pid(kind, configuration)) continue;
    std::vector<std::string> command = arguments_of_daemon(kind, configuration);
    command.insert(command.begin(), program(kLabProgram).string());
    const pid_t pid = start_detached(command, folder / (kind + ".log"));
    files::write_whole(folder / (kind + ".pid"), fmt::format("{}\n", pid));
    // Known by its command line, which it has only once it has become the daemon.
    const double until_s = rig::host_now_s() + 1;
    while (!running_pid(kind, configuration) && rig::host_now_s() < until_s)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return rig_status(configuration, 0);
}

std::vector<DaemonState> rig_status(const fs::path& configuration, double listen_s) {
  const auto kinds = daemon_kinds(configuration);
  std::map<std::string, selvedge_rig::device_status_t> heard;
  if (listen_s > 0) heard = listen(configuration, kinds, listen_s);
  std::vector<DaemonState> states;
  for (const std::string& kind : kinds) {
    DaemonState state{kind, running_pid(kind, configuration), std::nullopt,
                      state_folder(configuration) / (kind + ".log")};
    if (const auto found = heard.find(kind); found != heard.end()) state.status = found->second;
    states.push_back(std::move(state));
  }
  return states;
}

std::vector<std::string> rig_down(const fs::path& configuration) {
  std::vector<std::string> ended;
  for (const std::string& kind : daemon_kinds(configuration)) {
    if (const auto pid = running_pid(kind, configuration)) {
      ended.push_back(kind);
      ::kill(*pid, SIGTERM);
    }
  }
  const double until_s = rig::host_now_s() + kPatience_s;
  for (const std::string& kind : ended) {
    while (running_pid(kind, configuration) && rig::host_now_s() < until_s)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (const auto pid = running_pid(kind, configuration)) ::kill(*pid, SIGKILL);
    fs::remove(state_folder(configuration) / (kind + ".pid"));
  }
  return ended;
}

}  // namespace selvedge::station
