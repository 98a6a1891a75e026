// What `prove` and `bench` share: list the names, or run one, print its figures and write them as JSON.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/verify/figures.h"

namespace selvedge::cli {

// judged: exit status 1 where a figure does not hold.
void add_figure_command(CLI::App& app, const std::string& command, const std::string& description,
                        const std::vector<FigureSet>& sets, bool judged, int& exit_status);

}  // namespace selvedge::cli
