// The worked examples of examples/simulators on packages of Debian that a plain build does not need: the command that
// starts each, where its package is installed.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace selvedge::cli {

struct WorkedExample {
  std::string command;  // for `fit --simulator`
  std::string absent;   // not empty: the package of Debian that is not installed
};

inline bool shell_succeeds(const std::string& command) {
  return std::system((command + " >/dev/null 2>&1").c_str()) == 0;
}

// cells: quads along a side.
inline WorkedExample blender_cloth_example(int cells) {
  if (!shell_succeeds("command -v blender")) return {"", "blender"};
  return {"python3 '" SELVEDGE_SOURCE_DIR "/examples/simulators/blender_cloth.py' --cells " + std::to_string(cells),
          ""};
}

// Compiled into `folder` as its first lines say. Throws std::runtime_error where it does not compile.
inline WorkedExample bullet_example(const std::filesystem::path& folder) {
  if (!shell_succeeds("pkg-config --exists bullet")) return {"", "libbullet-dev"};
  const std::string program = "'" + (folder / "bullet").string() + "'";
  if (!shell_succeeds("g++ -std=c++20 -O2 '" SELVEDGE_SOURCE_DIR
                      "/examples/simulators/bullet.cpp' $(pkg-config --cflags --libs bullet) -o " +
                      program))
    throw std::runtime_error("examples/simulators/bullet.cpp does not compile");
  return {program, ""};
}

}  // namespace selvedge::cli
