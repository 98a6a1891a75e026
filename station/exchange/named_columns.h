// The columns of a lab's CSV by our names, as far as they are there.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace selvedge::station {

class NamedColumns {
 public:
  // theirs: what a column of ours is called there, where its name is another.
  explicit NamedColumns(std::filesystem::path file, std::map<std::string, std::string> theirs = {});

  bool has(const std::string& ours) const;
  // Throws BadInput naming file and column. An empty field is NaN where it may be empty.
  std::vector<double> operator()(const std::string& ours, bool may_be_empty = false) const;
  // Throws BadInput too where a number is not a whole one that an int holds.
  std::vector<int> whole_numbers(const std::string& ours) const;
  // The first of these that is there, and its values times its factor. Throws BadInput where none is.
  std::vector<double> first_of(const std::vector<std::pair<std::string, double>>& ours) const;

 private:
  std::string theirs(const std::string& ours) const;

  std::filesystem::path file_;
  std::map<std::string, std::string> theirs_;
  std::vector<std::string> header_;
};

}  // namespace selvedge::station
