// What a fit by least squares has found so far, on disk as soon as it is known, so that a fit killed at any time goes
// on.
//
// A fit that is started again asks for the same things in the same order, so each is found again by its name: costs of
// a coarse grid by batch, least squares by iteration. Text: a first line that says which fit, then a line each, the
// name, a colon and numbers with commas between, each in the shortest form that reads back as the same bits. Of several
// ranks the first alone has the file; the others get what it holds at the start and keep the rest in memory, so that
// all find the same.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimate/optimisers/journal_file.h"
#include "model/ranks/ranks.h"

namespace selvedge::estimate {

class FitJournal {
 public:
  // One of another fit is begun anew. Throws BadInput where a line is not one of its own.
  FitJournal(const std::filesystem::path& path, const std::string& identity);
  // On each of several ranks (null: on this process alone).
  static std::shared_ptr<FitJournal> shared(const std::filesystem::path& path, const std::string& identity,
                                            const std::shared_ptr<model::Ranks>& ranks);

  // "grid 1", "grid 2": what a stage keeps goes under its own name.
  std::string next(const std::string& stage) { return stage + " " + std::to_string(++count_[stage]); }

  // Null where nothing of that name was kept.
  const std::vector<double>* find(const std::string& name) const;
  void keep(const std::string& name, const std::vector<double>& numbers);

  size_t found() const { return found_; }  // when it was opened

 private:
  FitJournal() = default;  // in memory
  void take(const std::string& line, const std::string& where);

  std::optional<JournalFile> file_;
  size_t found_ = 0;
  std::map<std::string, int> count_;
  std::map<std::string, std::vector<double>> kept_;
};

}  // namespace selvedge::estimate
