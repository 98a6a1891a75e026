// A library to be preloaded into a process that records: notes every call that changes files below one folder, and
// stands for a disk that is slow, that fails, and whose power is cut. What of it all reaches the disk, disk_model.h
// decides.
//
// Set by environment variables:
//   SELVEDGE_CUT_ROOT     the folder; calls outside it pass
//   SELVEDGE_CUT_JOURNAL  the file of notes (journal_format.h)
//   SELVEDGE_CUT_SEED     of lengths and delays
//   SELVEDGE_CUT_AFTER    the process ends, without more ado, in the middle of the call of this number
//   SELVEDGE_CUT_FAIL     the sync of this number fails with EIO; 0: none
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <random>
#include <string>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "cli/verify/power_cut/journal_format.h"

namespace {

using selvedge::cli::Call;
using selvedge::cli::Note;

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

struct Disk {
  std::mutex mutex;  // a call and its note are one, so that notes stand in the order of what happened
  std::string root = variable("SELVEDGE_CUT_ROOT");
  int journal = -1;
  long cut_after = std::atol(variable("SELVEDGE_CUT_AFTER").c_str());
  long fail_sync = std::atol(variable("SELVEDGE_CUT_FAIL").c_str());
  long calls = 0;
  uint32_t syncs = 0;
  // As the kernel does, whoever ends a sync next is told once of what another sync failed to write: of the whole file
  // system, by every file and folder; of a file, by the whole file system (inode 0).
  int failed = 0, failed_whole = 0;
  std::map<uint64_t, int> told;
  std::mt19937 random{static_cast<unsigned>(std::atol(variable("SELVEDGE_CUT_SEED").c_str()))};

  Disk() {
    const std::string path = variable("SELVEDGE_CUT_JOURNAL");
    if (!path.empty())
      journal = static_cast<int>(
          ::syscall(SYS_openat, AT_FDCWD, path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
  }
};

Disk& disk() {
  static Disk* one = new Disk;  // never destroyed: calls come until the very end
  return *one;
}

template <class Function>
Function real(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

std::string absolute(const char* path) {
  if (path[0] == '/') return path;
  char folder[PATH_MAX];
  return ::getcwd(folder, sizeof folder) ? std::string(folder) + '/' + path : path;
}

bool is_below(const std::string& path) {
  const std::string& root = disk().root;
  return disk().journal >= 0 && !root.empty() && path.compare(0, root.size() + 1, root + '/') == 0;
}

std::string path_of(int descriptor) {
  char path[PATH_MAX];
  const ssize_t length = ::readlink(("/proc/self/fd/" + std::to_string(descriptor)).c_str(), path, sizeof path);
  return length > 0 ? std::string(path, static_cast<size_t>(length)) : "";
}

bool is_ours(int descriptor) { return disk().journal >= 0 && is_below(path_of(descriptor)); }

uint64_t inode_of(int descriptor) {
  struct stat status {};
  return ::fstat(descriptor, &status) == 0 ? status.st_ino : 0;
}

uint64_t inode_at(const std::string& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0 ? status.st_ino : 0;
}

// In one write, so that a note is there whole or not at all.
void note(Note entry, const std::string& path = "", const std::string& data = "") {
  entry.path_bytes = static_cast<uint32_t>(path.size());
  entry.data_bytes = static_cast<uint32_t>(data.size());
  const std::string bytes = std::string(reinterpret_cast<const char*>(&entry), sizeof entry) + path + data;
  if (::syscall(SYS_write, disk().journal, bytes.data(), bytes.size()) != static_cast<long>(bytes.size())) ::_exit(98);
}

// Before each call, with the mutex held.
bool power_is_cut() { return disk().cut_after > 0 && ++disk().calls >= disk().cut_after; }
void cut_if_due() {
  if (power_is_cut()) ::_exit(99);
}

int open_file(const char* path, int flags, mode_t mode) {
  using Open = int (*)(const char*, int, ...);
  static const Open call = real<Open>("open");
  const std::string full = absolute(path);
  if ((flags & (O_CREAT | O_TRUNC)) == 0 || !is_below(full)) return call(path, flags, mode);
  const std::lock_guard lock(disk().mutex);
  cut_if_due();
  const bool was_there = inode_at(full) != 0;
  const int descriptor = call(path, flags, mode);
  if (descriptor < 0) return descriptor;
  if (!was_there) note({Call::make_file, 0, 0, 0, inode_of(descriptor), 0}, full);
  else if (flags & O_TRUNC) note({Call::truncate, 0, 0, 0, inode_of(descriptor), 0});
  return descriptor;
}

// A write may be done in part, as any write may; the power is cut in the middle of one as well as before it.
template <class Write>
ssize_t write_part(int descriptor, const void* bytes, size_t count, uint64_t offset, Write write) {
  const bool cut = power_is_cut();
  if (count > 1 && (cut || disk().random() % 4 == 0)) count = 1 + disk().random() % (count - 1);
  const ssize_t done = write(count);
  if (done > 0)
    note({Call::write, 0, 0, 0, inode_of(descriptor), offset}, "",
         std::string(static_cast<const char*>(bytes), static_cast<size_t>(done)));
  if (cut) ::_exit(99);
  return done;
}

// Others go on writing while a sync takes its time: what they write then is not part of it. The machine's own disk is
// left in peace: what counts is what the model has of it.
int sync_slowly(uint64_t inode) {
  uint32_t number = 0;
  unsigned delay_us = 0;
  bool fails = false;
  {
    const std::lock_guard lock(disk().mutex);
    cut_if_due();
    number = ++disk().syncs;
    fails = static_cast<long>(number) == disk().fail_sync;
    delay_us = disk().random() % 6000;
    note({Call::sync_begins, 0, 0, number, inode, 0});
  }
  ::usleep(delay_us);
  const std::lock_guard lock(disk().mutex);
  cut_if_due();
  int& known = disk().told[inode];
  const bool first = fails;
  fails = fails || known < (inode == 0 ? disk().failed : disk().failed_whole);
  if (first || (fails && inode == 0)) ++disk().failed;
  if (fails && inode == 0) ++disk().failed_whole;
  known = inode == 0 ? disk().failed : disk().failed_whole;
  note({Call::sync_ends, 0, 0, number, inode, fails ? uint64_t{EIO} : uint64_t{0}});
  if (!fails) return 0;
  errno = EIO;
  return -1;
}

int make_folder(const char* path, mode_t mode) {
  static const auto call = real<int (*)(const char*, mode_t)>("mkdir");
  const std::string full = absolute(path);
  if (!is_below(full)) return call(path, mode);
  const std::lock_guard lock(disk().mutex);
  cut_if_due();
  const int result = call(path, mode);
  const int error = errno;
  if (result == 0) note({Call::make_folder, 0, 0, 0, inode_at(full), 0}, full);
  errno = error;
  return result;
}

int remove_entry(const char* path, const char* name) {
  const auto call = real<int (*)(const char*)>(name);
  const std::string full = absolute(path);
  if (!is_below(full)) return call(path);
  const std::lock_guard lock(disk().mutex);
  cut_if_due();
  const int result = call(path);
  if (result == 0) note({Call::remove}, full);
  return result;
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(list, mode_t) : 0;
  va_end(list);
  return open_file(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(list, mode_t) : 0;
  va_end(list);
  return open_file(path, flags, mode);
}

ssize_t write(int descriptor, const void* bytes, size_t count) {
  static const auto call = real<ssize_t (*)(int, const void*, size_t)>("write");
  if (!is_ours(descriptor)) return call(descriptor, bytes, count);
  const std::lock_guard lock(disk().mutex);
  const auto offset = static_cast<uint64_t>(::lseek(descriptor, 0, SEEK_CUR));
  return write_part(descriptor, bytes, count, offset, [&](size_t some) { return call(descriptor, bytes, some); });
}

ssize_t pwrite(int descriptor, const void* bytes, size_t count, off_t offset) {
  static const auto call = real<ssize_t (*)(int, const void*, size_t, off_t)>("pwrite");
  if (!is_ours(descriptor)) return call(descriptor, bytes, count, offset);
  const std::lock_guard lock(disk().mutex);
  return write_part(descriptor, bytes, count, static_cast<uint64_t>(offset),
                    [&](size_t some) { return call(descriptor, bytes, some, offset); });
}

ssize_t pwrite64(int descriptor, const void* bytes, size_t count, off64_t offset) {
  return pwrite(descriptor, bytes, count, offset);
}

int ftruncate(int descriptor, off_t length) {
  static const auto call = real<int (*)(int, off_t)>("ftruncate");
  if (!is_ours(descriptor)) return call(descriptor, length);
  const std::lock_guard lock(disk().mutex);
  cut_if_due();
  const int result = call(descriptor, length);
  if (result == 0) note({Call::truncate, 0, 0, 0, inode_of(descriptor), static_cast<uint64_t>(length)});
  return result;
}

int rename(const char* from, const char* to) {
  static const auto call = real<int (*)(const char*, const char*)>("rename");
  if (!is_below(absolute(from))) return call(from, to);
  const std::lock_guard lock(disk().mutex);
  cut_if_due();
  const int result = call(from, to);
  if (result == 0) note({Call::rename}, absolute(from), absolute(to));
  return result;
}

int mkdir(const char* path, mode_t mode) { return make_folder(path, mode); }
int unlink(const char* path) { return remove_entry(path, "unlink"); }
int rmdir(const char* path) { return remove_entry(path, "rmdir"); }
int remove(const char* path) { return remove_entry(path, "remove"); }

int fsync(int descriptor) {
  static const auto call = real<int (*)(int)>("fsync");
  if (!is_ours(descriptor) && path_of(descriptor) != disk().root) return call(descriptor);
  return sync_slowly(inode_of(descriptor));
}

int fdatasync(int descriptor) {
  static const auto call = real<int (*)(int)>("fdatasync");
  return is_ours(descriptor) ? sync_slowly(inode_of(descriptor)) : call(descriptor);
}

int syncfs(int descriptor) {
  static const auto call = real<int (*)(int)>("syncfs");
  return is_ours(descriptor) ? sync_slowly(0) : call(descriptor);
}

}  // extern "C"
