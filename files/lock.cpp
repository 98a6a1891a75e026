#include "files/lock.h"

#include <stdexcept>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "files/whole_file.h"

namespace selvedge::files {

Lock::Lock(const std::filesystem::path& path) { take(path); }

void Lock::take(const std::filesystem::path& path) {
  const int flags = std::filesystem::is_directory(path) ? O_RDONLY | O_DIRECTORY : O_RDWR | O_CREAT;
  descriptor_ = ::open(path.c_str(), flags | O_CLOEXEC, 0644);
  struct stat locked {
  }, there{};
  // A file that was replaced meanwhile is not the one that others look at.
  if (descriptor_ < 0 || (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 && ::fstat(descriptor_, &locked) == 0 &&
                          ::stat(path.c_str(), &there) == 0 && locked.st_ino == there.st_ino))
    return;
  ::close(descriptor_);
  descriptor_ = -1;
}

Lock::Lock(const std::filesystem::path& path, const std::string& owner, bool lives_once) {
  take(path);
  if (!held() && lives_once && std::filesystem::exists(path) && read_whole(path) == owner) {
    std::filesystem::remove(path);
    take(path);
  }
  if (!held()) return;
  if (::ftruncate(descriptor_, 0) != 0 ||
      ::pwrite(descriptor_, owner.data(), owner.size(), 0) != static_cast<ssize_t>(owner.size()))
    throw std::runtime_error(path.string() + ": the disk refuses the name of who holds it");
}

Lock::~Lock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace selvedge::files
