// A Slurm cluster of one node on this host: munged, slurmctld and slurmd of Debian, as the user who runs the test, with
// a configuration, keys and ports of its own in a folder. Everything that it started ends with it.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <sys/types.h>

namespace selvedge {

class SlurmCluster {
 public:
  // Takes up in SLURM_CONF of this process. Throws std::runtime_error, with the daemon's log, where one cannot be
  // started.
  explicit SlurmCluster(const std::filesystem::path& folder);
  ~SlurmCluster();
  SlurmCluster(const SlurmCluster&) = delete;
  SlurmCluster& operator=(const SlurmCluster&) = delete;

  void start_node();
  // As when its power goes: slurmd, and every process of every job on it. spared: a child of this process.
  void kill_node(pid_t spared);

  // Slurm has a requeued task wait for two minutes; what waits so begins now, as an administrator can have it.
  static void begin_requeued_now();
  // How often a task of an array was begun again.
  static int restarts(const std::string& array, size_t index);

 private:
  void start(const std::string& daemon, const std::vector<std::string>& arguments);
  void stop(const std::string& daemon);
  void wait_until(const std::string& command, const std::string& says, const std::string& daemon);

  std::filesystem::path folder_;
  std::map<std::string, pid_t> daemons_;
};

// Standard output of a command of the shell.
std::string output_of_shell(const std::string& command);

}  // namespace selvedge
