#include "files/durable.h"

#include <cerrno>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "files/file_error.h"

namespace selvedge::files {

namespace fs = std::filesystem;

fs::path folder_of(const fs::path& path) {
  const fs::path parent = path.parent_path();
  return parent.empty() ? fs::path(".") : parent;
}

void sync_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) fail(folder, "cannot be opened to be flushed to disk", errno);
  const int number = ::fsync(descriptor) == 0 ? 0 : errno;
  ::close(descriptor);
  // EINVAL: a file system that has nothing to sync for a folder.
  if (number != 0 && number != EINVAL) fail(folder, "cannot be flushed to disk", number);
}

void make_folders(const fs::path& folder) {
  std::vector<fs::path> missing;
  for (fs::path at = (fs::absolute(folder) / "").lexically_normal().parent_path(); !fs::exists(at);
       at = at.parent_path())
    missing.push_back(at);
  fs::create_directories(folder);
  for (const fs::path& made : missing) sync_folder(folder_of(made));
}

void sync_file_system(int descriptor, const fs::path& path) {
  if (::syncfs(descriptor) != 0) fail(path, "cannot be flushed to disk", errno);
}

}  // namespace selvedge::files
