#include "tests/slurm/slurm_cluster.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "files/whole_file.h"

namespace selvedge {

namespace fs = std::filesystem;

namespace {

int free_port() {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  ::bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address);
  ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &length);
  ::close(socket);
  return ntohs(address.sin_port);
}

std::string trimmed(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

std::string configuration(const fs::path& folder) {
  const std::string host = trimmed(output_of_shell("hostname -s")), user = trimmed(output_of_shell("id -un"));
  return fmt::format(
      "ClusterName=test\nSlurmctldHost={host}(127.0.0.1)\nSlurmctldPort={control}\nSlurmdPort={node}\n"
      "AuthType=auth/munge\nCredType=cred/munge\nAuthInfo=socket={folder}/munge.socket\nSlurmUser={user}\n"
      "SlurmdUser={user}\nStateSaveLocation={folder}/state\nSlurmdSpoolDir={folder}/spool\n"
      "SlurmctldPidFile={folder}/slurmctld.pid\nSlurmdPidFile={folder}/slurmd.pid\nProctrackType=proctrack/linuxproc\n"
      "TaskPlugin=task/none\nJobAcctGatherType=jobacct_gather/none\nAccountingStorageType=accounting_storage/none\n"
      "SwitchType=switch/none\nMpiDefault=none\nSelectType=select/cons_tres\nSelectTypeParameters=CR_Core\n"
      "SlurmdParameters=config_overrides\nReturnToService=2\nSlurmctldTimeout=10\nSlurmdTimeout=10\n"
      "BatchStartTimeout=5\nMessageTimeout=20\n"
      "NodeName=here NodeAddr=127.0.0.1 NodeHostname={host} CPUs=2\n"
      "PartitionName=all Nodes=here Default=YES State=UP\n",
      fmt::arg("host", host), fmt::arg("user", user), fmt::arg("folder", folder.string()),
      fmt::arg("control", free_port()), fmt::arg("node", free_port()));
}

// Children of a process, those of its threads too.
std::vector<pid_t> children_of(pid_t parent) {
  std::vector<pid_t> children;
  std::error_code gone;
  for (const auto& thread : fs::directory_iterator("/proc/" + std::to_string(parent) + "/task", gone)) {
    std::ifstream list(thread.path() / "children");
    for (pid_t child = 0; list >> child;) children.push_back(child);
  }
  return children;
}

void kill_with_descendants(pid_t process) {
  ::kill(process, SIGSTOP);  // so that it starts no other meanwhile
  for (const pid_t child : children_of(process)) kill_with_descendants(child);
  ::kill(process, SIGKILL);
}

bool has_ended(pid_t child, double patience_s) {
  for (int i = 0; i < static_cast<int>(patience_s * 50); ++i) {
    if (::waitpid(child, nullptr, WNOHANG) != 0) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return false;
}

}  // namespace

std::string output_of_shell(const std::string& command) {
  FILE* const pipe = ::popen(command.c_str(), "r");
  std::string text;
  char buffer[4096];
  for (size_t count; pipe && (count = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) text.append(buffer, count);
  if (pipe) ::pclose(pipe);
  return text;
}

SlurmCluster::SlurmCluster(const fs::path& folder) : folder_(folder) {
  // Processes of jobs whose slurmd is gone become children of this one, and are found by that.
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  ::setenv("PATH", (std::string(std::getenv("PATH")) + ":/usr/sbin").c_str(), 1);
  ::setenv("SLURM_CONF", (folder / "slurm.conf").c_str(), 1);
  for (const char* name : {"state", "spool"}) fs::create_directories(folder / name);
  fs::permissions(folder, fs::perms::owner_all);
  std::random_device device;  // a secret of this cluster, nothing that a result depends on
  std::string key;
  while (key.size() < 64) key += fmt::format("{:08x}", device());
  files::write_whole(folder / "munge.key", key);
  fs::permissions(folder / "munge.key", fs::perms::owner_read | fs::perms::owner_write);
  files::write_whole(folder / "slurm.conf", configuration(folder));

  const auto at = [&](const char* name) { return (folder / name).string(); };
  start("munged",
        {"--foreground", "--force", "--key-file=" + at("munge.key"), "--socket=" + at("munge.socket"),
         "--pid-file=" + at("munge.pid"), "--seed-file=" + at("munge.seed"), "--log-file=" + at("munge.log")});
  wait_until("munge --no-input --socket=" + at("munge.socket") + " >/dev/null 2>&1 && echo up", "up", "munged");
  start("slurmctld", {"-D"});
  wait_until("scontrol ping 2>&1", "is UP", "slurmctld");
  start_node();
}

SlurmCluster::~SlurmCluster() {
  output_of_shell("scancel --state=PENDING --me; scancel --state=RUNNING --me");
  for (const char* daemon : {"slurmctld", "slurmd", "munged"}) stop(daemon);
  kill_node(0);
}

void SlurmCluster::start_node() {
  start("slurmd", {"-D", "-N", "here"});
  wait_until("sinfo --noheader --nodes=here --format=%T", "idle", "slurmd");
}

void SlurmCluster::kill_node(pid_t spared) {
  std::set<pid_t> kept = {spared};
  for (const auto& [name, process] : daemons_)
    if (name != "slurmd") kept.insert(process);
  // What a killed process leaves becomes a child of this one in turn.
  for (int round = 0; round < 50; ++round) {
    bool any = false;
    for (const pid_t child : children_of(::getpid()))
      if (!kept.contains(child)) {
        any = true;
        kill_with_descendants(child);
        ::waitpid(child, nullptr, 0);
      }
    if (!any) break;
  }
  daemons_.erase("slurmd");
}

void SlurmCluster::start(const std::string& daemon, const std::vector<std::string>& arguments) {
  std::vector<char*> words = {const_cast<char*>(daemon.c_str())};
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  const int log = ::open((folder_ / (daemon + ".log")).c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const pid_t child = ::fork();
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::dup2(log, 1);
    ::dup2(log, 2);
    ::execvp(words[0], words.data());
    ::_exit(127);
  }
  ::close(log);
  daemons_[daemon] = child;
}

void SlurmCluster::stop(const std::string& daemon) {
  const auto at = daemons_.find(daemon);
  if (at == daemons_.end()) return;
  ::kill(at->second, SIGTERM);
  if (!has_ended(at->second, 10)) {
    kill_with_descendants(at->second);
    ::waitpid(at->second, nullptr, 0);
  }
  daemons_.erase(at);
}

void SlurmCluster::wait_until(const std::string& command, const std::string& says, const std::string& daemon) {
  for (int i = 0; i < 300; ++i) {
    if (output_of_shell(command).find(says) != std::string::npos) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  throw std::runtime_error(fmt::format("{} does not come up (packages slurmctld, slurmd, slurm-client, munge):\n{}",
                                       daemon, files::read_whole(folder_ / (daemon + ".log"))));
}

void SlurmCluster::begin_requeued_now() {
  std::istringstream lines(output_of_shell("squeue --me --noheader --array --states=PENDING --format='%F_%K %r'"));
  for (std::string task, reason; lines >> task && std::getline(lines, reason);)
    if (reason.find("BeginTime") != std::string::npos)
      output_of_shell("scontrol update JobId=" + task + " StartTime=now 2>&1");
}

int SlurmCluster::restarts(const std::string& array, size_t index) {
  const std::string about = output_of_shell(fmt::format("scontrol show job {}_{} 2>&1", array, index));
  const size_t at = about.find("Restarts=");
  return at == std::string::npos ? 0 : std::atoi(about.c_str() + at + 9);
}

}  // namespace selvedge
