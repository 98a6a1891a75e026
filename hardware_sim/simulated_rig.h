// Every simulated device of a rig in one process, around one world: GigE Vision camera, DLPC350 projector with
// its trigger line to the camera, DataStream tracker, RTDE arm, and the person who obeys OPERATOR_PROMPT.
//
// [devices] of the world's file, every key optional:
//   camera_address camera_rate_hz camera_clock_offset_s camera_clock_drift_ppm
//   tracker_port tracker_rate_hz tracker_noise_m tracker_latency_s tracker_occlusions_per_s
//   tracker_stated_latency_s   what the tracker itself says of its latency, where that is not so
//   projector_socket flash_table
//   arm_model ("" for none) arm_port arm_script_port
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "hardware_sim/datastream_server/datastream_server.h"
#include "hardware_sim/dlpc350/dlpc350_server.h"
#include "hardware_sim/gige_camera/gige_camera.h"
#include "hardware_sim/rtde_controller/rtde_controller.h"
#include "hardware_sim/world/world_configuration.h"
#include "rig/configuration.h"

namespace selvedge::hardware_sim {

struct SimulatedRigConfiguration {
  WorldConfiguration world;
  rig::BusConfiguration bus;
  sim::GigeCameraOptions camera;
  DatastreamServerOptions tracker;
  std::filesystem::path projector_socket = "/tmp/selvedge-projector.sock";
  std::filesystem::path flash_table;  // empty: the standard one
  std::filesystem::path arm_model;    // empty: no arm
  RtdeControllerOptions arm;
};

// Throws BadInput naming file, section and key.
SimulatedRigConfiguration read_simulated_rig(const std::filesystem::path& path);

// What world and devices are like, for comparing afterwards (truth_json of the world), with what they hide: effects by
// the names of the exchange format.
nlohmann::json truth_json(const SimulatedRigConfiguration& configuration);

class SimulatedRig {
 public:
  // Throws BadInput where an address cannot be had.
  explicit SimulatedRig(const SimulatedRigConfiguration& configuration);
  ~SimulatedRig();

  // One line a device for a person: where it answers.
  const std::string& description() const { return description_; }

  // For faults on request, and for what really happened.
  sim::GigeCamera& camera();
  DatastreamServer& tracker();
  Dlpc350Server& projector();
  RtdeController* arm();  // nullptr where there is none

 private:
  struct Devices;
  std::unique_ptr<Devices> devices_;
  std::string description_;
};

}  // namespace selvedge::hardware_sim
