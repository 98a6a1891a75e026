#include "files/append_file.h"

#include <cerrno>

#include <fcntl.h>
#include <unistd.h>

#include "files/durable.h"
#include "files/file_error.h"
#include "files/whole_file.h"

namespace selvedge::files {

AppendFile::AppendFile(const std::filesystem::path& path, const std::string& first_line) : path_(path) {
  descriptor_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (descriptor_ < 0) fail(path, "cannot be created", errno);
  try {
    append(first_line);
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

AppendFile::AppendFile(const std::filesystem::path& path) : path_(path) {
  const size_t last_break = read_whole(path).rfind('\n');
  length_ = last_break == std::string::npos ? 0 : static_cast<long long>(last_break) + 1;
  descriptor_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor_ < 0) fail(path, "cannot be opened", errno);
  if (::ftruncate(descriptor_, length_) == 0) return;
  const int number = errno;
  ::close(descriptor_);
  fail(path, "cannot be cut back to its last whole line", number);
}

AppendFile::~AppendFile() { ::close(descriptor_); }

void AppendFile::append(const std::string& lines) {
  size_t written = 0;
  while (written < lines.size()) {
    const ssize_t count = ::pwrite(descriptor_, lines.data() + written, lines.size() - written,
                                   length_ + static_cast<long long>(written));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int number = errno;
      // Freeing space never needs any; should it fail all the same, the reader passes over a torn line.
      [[maybe_unused]] const int ignored = ::ftruncate(descriptor_, length_);
      fail(path_, "cannot be appended to", number);
    }
    written += static_cast<size_t>(count);
  }
  length_ += static_cast<long long>(lines.size());
}

void AppendFile::sync() {
  if (::fdatasync(descriptor_) != 0) fail(path_, "cannot be flushed to disk", errno);
  if (!is_entered_) sync_folder(folder_of(path_));
  is_entered_ = true;
}

}  // namespace selvedge::files
