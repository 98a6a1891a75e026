// What the fuzzers share: a folder in memory for readers that take a path, and the one way to be refused.
//
// A fuzzer catches the project's refusals alone (BadInput; WireError and its kin where the decoder is one of a wire).
// Every other exception, std::bad_alloc and those of a library among them, ends it as a crash does.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include "files/bad_input.h"

namespace selvedge::fuzz {

// $SELVEDGE_FUZZ_FOLDER, which whoever runs the fuzzer removes; else a new one in /dev/shm.
inline const std::filesystem::path& memory_folder() {
  static const std::filesystem::path folder = [] {
    if (const char* given = std::getenv("SELVEDGE_FUZZ_FOLDER")) return std::filesystem::path(given);
    char name[] = "/dev/shm/selvedge-fuzz-XXXXXX";
    if (::mkdtemp(name) == nullptr) std::abort();
    return std::filesystem::path(name);
  }();
  return folder;
}

inline void put(const std::filesystem::path& path, std::string_view bytes) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (descriptor < 0 || ::write(descriptor, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
    std::abort();
  ::close(descriptor);
}

inline std::string_view text_of(const uint8_t* data, size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

template <class Action>
void or_refused(Action action) {
  try {
    action();
  } catch (const BadInput&) {}
}

}  // namespace selvedge::fuzz
