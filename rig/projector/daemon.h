// The projector's daemon: shows what projector_command_t asks for, and says what shows.
//
// Commands are obeyed in the order in which they came. projector_status_t follows once the pattern is on the
// mirrors, or with `refused` where it cannot be shown, and twice a second besides. A projector that went away
// is looked for twice a second, and shows the last pattern again once it is back. The lamp is dark before the
// first command and after the last.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "rig/configuration.h"
#include "rig/projector/projector.h"

namespace selvedge::projector {

struct ProjectorConfiguration {
  std::string backend = "dlpc350";  // or "window"
  ProjectorOptions device;
  WindowOptions window;
  int width_px = 912;  // columns and rows that pattern coordinates run over
  int height_px = 1140;
};

// [projector] of the configuration. Throws BadInput.
ProjectorConfiguration read_configuration(rig::Section keys);

std::unique_ptr<Projector> open(const ProjectorConfiguration& configuration);

// Runs until `stopping`.
void run_daemon(const rig::Configuration& configuration, const std::atomic<bool>& stopping,
                const std::string& device = "projector");

}  // namespace selvedge::projector
