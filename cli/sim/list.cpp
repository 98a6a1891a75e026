#include "cli/command.h"

namespace selvedge::cli {

const std::vector<AddCommand>& simulation_commands() {
  static const std::vector<AddCommand> list = {add_demo, add_simulate_devices};
  return list;
}

}  // namespace selvedge::cli
