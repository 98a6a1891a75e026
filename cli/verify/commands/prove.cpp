#include "cli/command.h"
#include "cli/verify/figure_command.h"

namespace selvedge::cli {

void add_prove(CLI::App& app, int& exit_status) {
  add_figure_command(app, "prove", "Show figures beside their reference; exit 1 where one falls short", proofs(), true,
                     exit_status);
}

}  // namespace selvedge::cli
