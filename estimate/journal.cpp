#include "estimate/journal.h"

#include <algorithm>
#include <charconv>
#include <sstream>

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
    : file_(std::in_place, free_of_others(path, identity), identity) {
  for (size_t i = 0; i < file_->lines().size(); ++i) take(file_->lines()[i], file_->where(i));
}

std::shared_ptr<FitJournal> FitJournal::shared(const std::filesystem::path& path, const std::string& identity,
                                               const std::shared_ptr<model::Ranks>& ranks) {
  if (!ranks) return std::make_shared<FitJournal>(path, identity);
  if (ranks->is_first()) {
    const auto journal = std::make_shared<FitJournal>(path, identity);
    std::string held;
    for (const std::string& line : journal->file_->lines()) held += line + "\n";
    ranks->answer(held);
    return journal;
  }
  const std::shared_ptr<FitJournal> journal(new FitJournal);
  std::istringstream held(ranks->follow({}));
  for (std::string line; std::getline(held, line);) journal->take(line, "the first rank's journal");
  return journal;
}

void FitJournal::take(const std::string& line, const std::string& where) {
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
  if (!at) refuse(where, "found {}, expected a name, a colon and numbers", in_quotes(line.substr(0, 60)));
  kept_[line.substr(0, colon)] = std::move(numbers);
  ++found_;
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
  if (file_) file_->append(line + "\n");
  kept_[name] = numbers;
}

}  // namespace selvedge::estimate
