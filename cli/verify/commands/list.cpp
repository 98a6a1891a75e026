#include "cli/command.h"

namespace selvedge::cli {

const std::vector<AddCommand>& verify_commands() {
  static const std::vector<AddCommand> list = {add_blind, add_prove, add_bench, add_soak, add_recorder_of_proof};
  return list;
}

}  // namespace selvedge::cli
