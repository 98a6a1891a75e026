// The rig's daemons as processes that live on by themselves: started, looked at and ended by configuration file.
//
// Beside FILE.toml lies FILE.rig/ with KIND.pid and KIND.log for each daemon. A number in a .pid file counts only
// while the process of that number is this program running that daemon, so a number that the system gave to
// somebody else is never signalled.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <selvedge_rig/device_status_t.hpp>
#include <sys/types.h>

namespace selvedge::station {

struct DaemonState {
  std::string kind;                                     // camera, tracker, projector, arm
  std::optional<pid_t> pid;                             // of the process that rig_up started
  std::optional<selvedge_rig::device_status_t> status;  // newest on the bus
  std::filesystem::path log;
};

// Sections of the configuration that have a daemon, in the order in which they are started.
std::vector<std::string> daemon_kinds(const std::filesystem::path& configuration);

// Starts what does not run yet. Throws BadInput where the configuration is no good or the host has no multicast.
std::vector<DaemonState> rig_up(const std::filesystem::path& configuration);
// listen_s: how long to wait for each daemon's word on the bus; 0: processes alone.
std::vector<DaemonState> rig_status(const std::filesystem::path& configuration, double listen_s);
// Ends what runs: SIGTERM, after ten seconds SIGKILL. Returns the kinds that ran.
std::vector<std::string> rig_down(const std::filesystem::path& configuration);

}  // namespace selvedge::station
