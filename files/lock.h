// A file or folder that one process has to itself; let go of when the process ends, however it ends.
#pragma once

#include <filesystem>

namespace selvedge::files {

class Lock {
 public:
  // A file that is not there is made. Waits for nothing: see `held`.
  explicit Lock(const std::filesystem::path& path);
  ~Lock();
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

  // False where another has it, or where it cannot be opened.
  bool held() const { return descriptor_ >= 0; }

 private:
  int descriptor_ = -1;
};

}  // namespace selvedge::files
