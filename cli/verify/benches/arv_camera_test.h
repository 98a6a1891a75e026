// Aravis's own client, run for a while as a user would run it.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <fmt/format.h>

namespace selvedge::cli {

struct ArvCounts {
  int64_t whole = 0;  // frames
  int64_t lost = 0;   // that it knows of: not whole, or missing in the ids
};

// more: arguments besides name, rate and duration, each with a space before it.
inline ArvCounts run_arv_camera_test(const std::string& name, double rate_hz, double seconds,
                                     const std::string& more = "") {
  const std::string command =
      fmt::format("arv-camera-test-0.8 -n {} -f {} -e 2000 --duration {:.0f}{} 2>&1", name, rate_hz, seconds, more);
  std::string text;
  char part[4096];
  FILE* const pipe = ::popen(command.c_str(), "r");
  while (std::fgets(part, sizeof part, pipe)) text += part;
  ::pclose(pipe);
  const auto number_after = [&](const char* label) -> int64_t {  // 0 where the transport has no such count
    const size_t place = text.find(label);
    return place == std::string::npos ? 0 : std::atoll(text.c_str() + text.find('=', place) + 1);
  };
  return {number_after("n_completed_buffers"), number_after("n_failures") + number_after("n_missing_frames")};
}

}  // namespace selvedge::cli
