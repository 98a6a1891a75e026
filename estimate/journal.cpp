#include "estimate/journal.h"

#include <algorithm>
#include <charconv>

#include "files/bad_input.h"
#include "files/csv_table.h"

namespace selvedge::estimate {

namespace {

const std::filesystem::path& free_of_others(const std::filesystem::path& path, const std::string& identity) {
  if (JournalFile::is_of_another(path, identity)) std::filesystem::remove(path);
  return path;
}

}  // namespace

FitJournal::FitJournal(const std::filesystem::path& path, const std::string& identity)
    : file_(free_of_others(path, identity), identity) {
  for (size_t i = 0; i < file_.lines().size(); ++i) {
    const std::string& line = file_.lines()[i];
    const size_t colon = line.find(':');
    std::vector<double> numbers;
    const char* const end = line.data() + line.size();
    const char* at = colon == std::string::npos ? nullptr : line.data() + colon + 1;
    while (at && at < end) {
      double x = 0;
      const auto read = std::from_chars(at, end, x);
      const bool good = read.ec == std::errc() && (read.ptr == end || *read.ptr == ',');
      at = good ? std::min(read.ptr + 1, end) : nullptr;
      numbers.push_back(x);
    }
    if (!at) refuse(file_.where(i), "found {}, expected a name, a colon and numbers", in_quotes(line.substr(0, 60)));
    kept_[line.substr(0, colon)] = std::move(numbers);
  }
}

const std::vector<double>* FitJournal::find(const std::string& name) const {
  const auto at = kept_.find(name);
  return at == kept_.end() ? nullptr : &at->second;
}

void FitJournal::keep(const std::string& name, const std::vector<double>& numbers) {
  std::string line = name + ":";
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0) line += ',';
    files::append_number(line, numbers[i]);
  }
  file_.append(line + "\n");
  kept_[name] = numbers;
}

}  // namespace selvedge::estimate
