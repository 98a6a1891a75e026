#include "station/simulated_rig.h"

#include <sstream>

#include <unistd.h>

#include "files/bad_input.h"
#include "files/toml_text.h"
#include "files/whole_file.h"
#include "rig/camera/frame_ring.h"
#include "station/free_addresses.h"
#include "station/programs.h"
#include "station/rig_processes.h"

namespace selvedge::station {

namespace {

namespace fs = std::filesystem;

void write_toml(const fs::path& path, const toml::table& table) {
  std::ostringstream text;
  text << table << '\n';
  files::write_whole(path, text.str());
}

toml::table& section(toml::table& file, const char* name) {
  if (!file.contains(name)) file.insert(name, toml::table{});
  return *file[name].as_table();
}

// A UNIX socket's path may have 107 characters, and a run's folder may lie deep.
fs::path socket_path() {
  return fs::temp_directory_path() / ("selvedge-projector-" + std::to_string(::getpid()) + ".sock");
}

// A rig that is started again in a folder speaks on the bus that it had: a console that listens there goes on.
int bus_port_in(const fs::path& folder) {
  if (!fs::exists(folder / "rig.toml")) return free_bus_port();
  return static_cast<int>(files::read_toml(folder / "rig.toml")["bus"]["port"].value_or(int64_t{free_bus_port()}));
}

}  // namespace

void write_simulated_rig(const SimulatedRigFiles& files, const fs::path& folder) {
  toml::table rig = files::read_toml(files.rig), world = files::read_toml(files.world);
  const int bus_port = bus_port_in(folder), tracker_port = free_tcp_port(), arm_port = free_tcp_port(),
            script_port = free_tcp_port();
  const std::string camera_address = free_camera_address(), socket = socket_path().string();

  section(rig, "bus").insert_or_assign("port", bus_port);
  section(rig, "camera").insert_or_assign("address", camera_address);
  section(rig, "tracker").insert_or_assign("port", tracker_port);
  section(rig, "projector").insert_or_assign("transport", "unix:" + socket);

  section(world, "bus").insert_or_assign("port", bus_port);
  toml::table& devices = section(world, "devices");
  devices.insert_or_assign("camera_address", camera_address);
  devices.insert_or_assign("tracker_port", tracker_port);
  devices.insert_or_assign("projector_socket", socket);
  if (rig.contains("arm")) {
    toml::table& arm = section(rig, "arm");
    const std::string model = (files.arms / fs::path(arm["model"].value_or(std::string())).filename()).string();
    arm.insert_or_assign("model", model);
    arm.insert_or_assign("port", arm_port);
    arm.insert_or_assign("script_port", script_port);
    // A run that was stopped, killed and started again is still stopped.
    arm.insert_or_assign("stop_file", fs::absolute(folder / "arm.stopped").string());
    devices.insert_or_assign("arm_model", model);
    devices.insert_or_assign("arm_port", arm_port);
    devices.insert_or_assign("arm_script_port", script_port);
  } else {
    devices.erase("arm_model");
  }
  write_toml(folder / "rig.toml", rig);
  write_toml(folder / "world.toml", world);
}

SimulatedRig::SimulatedRig(const SimulatedRigFiles& files, const fs::path& folder) {
  const fs::path logs = folder / "logs";
  fs::create_directories(logs);
  write_simulated_rig(files, folder);
  configuration_ = rig::Configuration::load(folder / "rig.toml");
  const std::string lab = program(kLabProgram).string(), simulation = program(kSimulationProgram).string();
  const auto start = [&](const std::string& name, const std::vector<std::string>& command) {
    processes_.push_back(std::make_unique<ChildProcess>(name, command, logs / (name + ".log")));
  };
  start("devices", {simulation, "simulate-devices", "--config", (folder / "world.toml").string(), "--truth",
                    (folder / "truth.json").string()});
  for (const std::string& kind : daemon_kinds(folder / "rig.toml"))
    start(kind, {lab, "daemon", kind, "--config", (folder / "rig.toml").string()});
}

SimulatedRig::~SimulatedRig() {
  for (auto process = processes_.rbegin(); process != processes_.rend(); ++process) (*process)->terminate();
  while (!processes_.empty()) processes_.pop_back();
  camera::FrameRingWriter::remove(camera::ring_name(configuration_.bus().port, "camera"));
  std::error_code gone_already;
  fs::remove(socket_path(), gone_already);
}

void SimulatedRig::require_running() {
  for (const auto& process : processes_) process->require_running();
}

}  // namespace selvedge::station
