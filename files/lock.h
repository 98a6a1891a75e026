// A file or folder that one process has to itself; let go of when the process ends, however it ends.
#pragma once

#include <filesystem>
#include <string>

namespace selvedge::files {

class Lock {
 public:
  // A file that is not there is made. Waits for nothing: see `held`.
  explicit Lock(const std::filesystem::path& path);
  // A file that says, while it is held, by whom. lives_once: there is never more than one living process of that name
  // (a task of a batch system, say). Where the file says that name already and still seems held, its process is dead
  // and a file server has not noticed yet: the file is replaced.
  Lock(const std::filesystem::path& path, const std::string& owner, bool lives_once);
  ~Lock();
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

  // False where another has it, or where it cannot be opened.
  bool held() const { return descriptor_ >= 0; }

 private:
  void take(const std::filesystem::path& path);

  int descriptor_ = -1;
};

}  // namespace selvedge::files
