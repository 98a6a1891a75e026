// What another program said, and how it ended.
#pragma once

#include <string>
#include <vector>

namespace selvedge::station {

struct CommandOutput {
  bool found = false;       // the program is there
  int exit_status = -1;     // −1: it was ended by a signal, or is not there
  std::string out, errors;  // what it wrote to its standard output and error
};

// Looks the program up in PATH, and waits for its end.
CommandOutput output_of(const std::vector<std::string>& command);

}  // namespace selvedge::station
