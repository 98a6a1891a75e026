// Clients that are not ours, run as a user would run them.
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace selvedge::camera {

inline bool installed(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) == 0;
}
// What it says, errors and all.
inline std::string output(const std::string& command) {
  std::string text;
  FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  std::array<char, 4096> part{};
  while (std::fgets(part.data(), part.size(), pipe)) text += part.data();
  ::pclose(pipe);
  return text;
}
// The number behind the next '=' after a label; -1 where it is not there.
inline int64_t number_after(const std::string& text, const std::string& label) {
  const size_t place = text.find(label);
  return place == std::string::npos ? -1 : std::atoll(text.c_str() + text.find('=', place) + 1);
}

}  // namespace selvedge::camera
