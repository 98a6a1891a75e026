// A text file that only grows, line by line. A line is written once the kernel has it: it then survives the end
// of this process, however abrupt. `sync` makes it durable: it then survives a loss of power.
#pragma once

#include <filesystem>
#include <string>

namespace selvedge::files {

class AppendFile {
 public:
  // Creates the file with its first line; there must be none of that name. Throws std::runtime_error.
  AppendFile(const std::filesystem::path& path, const std::string& first_line);

  // Goes on after the last whole line of a file that is there. Throws std::runtime_error.
  explicit AppendFile(const std::filesystem::path& path);

  ~AppendFile();
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;

  // Whole lines with their line breaks. Where the disk refuses, the file is cut back to its last whole
  // line and std::runtime_error names path and cause.
  void append(const std::string& lines);

  // Everything appended so far, and the file's entry in its folder. Throws std::runtime_error where the disk fails.
  void sync();

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  long long length_ = 0;     // bytes known to be whole lines
  bool is_entered_ = false;  // its folder was synced since it was made
};

}  // namespace selvedge::files
