// The file of a journal: a first line that says what of, then whole lines, each on disk as soon as it is known.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "files/append_file.h"

namespace selvedge::estimate {

class JournalFile {
 public:
  // Begins the file, or reads what is there; a last line torn by a kill is cut. Throws BadInput where its first line is
  // not of this identity (one line).
  JournalFile(const std::filesystem::path& path, const std::string& identity);

  // Whether there is one, and of another identity.
  static bool is_of_another(const std::filesystem::path& path, const std::string& identity);

  const std::vector<std::string>& lines() const { return lines_; }  // found when it was opened, without the first
  std::string where(size_t line) const;                             // "PATH:LINE", for errors
  void append(const std::string& whole_lines) { file_->append(whole_lines); }

 private:
  std::filesystem::path path_;
  std::vector<std::string> lines_;
  std::unique_ptr<files::AppendFile> file_;
};

}  // namespace selvedge::estimate
