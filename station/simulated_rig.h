// The simulated devices and the daemons that drive them, as child processes with ports and addresses of their own.
//
// Writes FOLDER/rig.toml and FOLDER/world.toml from the given examples, and FOLDER/logs/NAME.log for each process.
// What the world is like lies in world.toml and truth.json alone; session and fit never read them.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "rig/configuration.h"
#include "station/child_process.h"

namespace selvedge::station {

struct SimulatedRigFiles {
  std::filesystem::path rig;    // as examples/demo-rig.toml
  std::filesystem::path world;  // as examples/demo-world.toml
  std::filesystem::path arms;   // folder of the arms' models
};

// FOLDER/rig.toml and FOLDER/world.toml: the examples with ports and addresses that are free now and fit each other;
// the bus keeps the port that it had in the folder.
void write_simulated_rig(const SimulatedRigFiles& files, const std::filesystem::path& folder);

class SimulatedRig {
 public:
  // Throws BadInput for files that are no good. Returns at once; the session waits for the devices.
  SimulatedRig(const SimulatedRigFiles& files, const std::filesystem::path& folder);
  ~SimulatedRig();  // ends all of them, the daemons first

  const rig::Configuration& configuration() const { return configuration_; }
  // Throws where one of the processes has ended.
  void require_running();

 private:
  rig::Configuration configuration_;
  std::vector<std::unique_ptr<ChildProcess>> processes_;  // devices first
};

}  // namespace selvedge::station
