#include "cli/command.h"

namespace selvedge::cli {

const std::vector<AddCommand>& lab_commands() {
  static const std::vector<AddCommand> list = {
      add_session,    add_console, add_check,    add_recover, add_calibrate, add_fit,       add_fabrics,
      add_experiment, add_garment, add_diagnose, add_compare, add_watch,     add_simulator, add_export,
      add_import,     add_rig,     add_arm,      add_daemon,  add_shell,
  };
  return list;
}

}  // namespace selvedge::cli
