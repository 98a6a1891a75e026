#include "estimate/optimisers/journal_file.h"

#include "files/bad_input.h"
#include "files/whole_file.h"

namespace selvedge::estimate {

namespace {

std::string first_line(const std::string& identity) { return "selvedge-journal/1 " + identity + "\n"; }

// Without a whole first line it was begun and no more: nothing is in it.
bool has_begun(const std::string& text) { return text.find('\n') != std::string::npos; }

}  // namespace

bool JournalFile::is_of_another(const std::filesystem::path& path, const std::string& identity) {
  if (!std::filesystem::exists(path)) return false;
  const std::string text = files::read_whole(path);
  return has_begun(text) && text.rfind(first_line(identity), 0) != 0;
}

JournalFile::JournalFile(const std::filesystem::path& path, const std::string& identity) : path_(path) {
  const std::string first = first_line(identity);
  const std::string text = std::filesystem::exists(path) ? files::read_whole(path) : "";
  if (!has_begun(text)) {
    std::filesystem::remove(path);
    if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path());
    file_ = std::make_unique<files::AppendFile>(path, first);
    return;
  }
  if (text.rfind(first, 0) != 0)
    refuse(path.string(),
           "found the journal of another search, {}, expected that of this one, {}; choose another folder or remove it",
           in_quotes(text.substr(0, text.find('\n'))), in_quotes(first.substr(0, first.size() - 1)));
  for (size_t at = first.size(), end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
    lines_.push_back(text.substr(at, end - at));
  file_ = std::make_unique<files::AppendFile>(path);
}

std::string JournalFile::where(size_t line) const { return path_.string() + ":" + std::to_string(line + 2); }

}  // namespace selvedge::estimate
