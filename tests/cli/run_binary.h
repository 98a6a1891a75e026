// Runs the built ./selvedge as a user would, and keeps what it printed.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include <sys/wait.h>

#include "files/whole_file.h"

namespace selvedge::cli {

struct Ran {
  int exit_status = -1;  // -1: ended by a signal
  std::string out, err;
};

// arguments: as on a shell's command line. It runs in `folder`; its output goes beside that folder.
inline Ran run_binary(const std::string& arguments, const std::filesystem::path& folder) {
  const std::string beside = (folder / "").parent_path().string();
  const std::string out = beside + ".out", err = beside + ".err";
  const std::string command =
      "cd '" + folder.string() + "' && '" SELVEDGE_BINARY "' " + arguments + " >'" + out + "' 2>'" + err + "'";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, files::read_whole(out), files::read_whole(err)};
}

}  // namespace selvedge::cli
