#include "cli/command.h"
#include "cli/verify/figure_command.h"

namespace selvedge::cli {

void add_bench(CLI::App& app, int& exit_status) {
  add_figure_command(app, "bench", "Show timings as medians, and ratios to a peer in the same run", benches(), false,
                     exit_status);
}

}  // namespace selvedge::cli
