#include "cli/verify/soak/small_disk.h"

#include <fstream>

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/statvfs.h>
#include <unistd.h>

namespace selvedge::cli {

namespace {

constexpr const char* kFiller = "filler";

bool write_line(const char* path, const std::string& text) {
  std::ofstream file(path);
  return static_cast<bool>(file << text << std::flush);
}

// Root needs no user namespace of its own.
bool enter_mount_namespace() {
  if (::unshare(CLONE_NEWNS) == 0) return true;
  const auto user = ::getuid();
  const auto group = ::getgid();
  return ::unshare(CLONE_NEWUSER | CLONE_NEWNS) == 0 && write_line("/proc/self/setgroups", "deny") &&
         write_line("/proc/self/uid_map", fmt::format("0 {} 1", user)) &&
         write_line("/proc/self/gid_map", fmt::format("0 {} 1", group));
}

}  // namespace

bool mount_small_disk(const std::filesystem::path& folder, size_t bytes) {
  std::filesystem::create_directories(folder);
  return enter_mount_namespace() && ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         ::mount("selvedge", folder.c_str(), "tmpfs", 0, fmt::format("size={}", bytes).c_str()) == 0;
}

void fill_disk(const std::filesystem::path& folder) {
  struct statvfs status {};
  if (::statvfs(folder.c_str(), &status) != 0) return;
  const int descriptor = ::open((folder / kFiller).c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  if (descriptor < 0) return;
  // All at once, so that nobody gets in between; what is freed meanwhile fills up by itself.
  const int told = ::posix_fallocate(descriptor, 0, static_cast<off_t>(status.f_bavail * status.f_bsize));
  ::close(descriptor);
  if (told != 0) clear_disk(folder);
}

void clear_disk(const std::filesystem::path& folder) {
  std::error_code gone_already;
  std::filesystem::remove(folder / kFiller, gone_already);
}

}  // namespace selvedge::cli
