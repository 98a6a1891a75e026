#include "station/exchange/named_columns.h"

#include <algorithm>
#include <sstream>

#include "files/bad_input.h"
#include "files/csv_table.h"
#include "files/whole_file.h"

namespace selvedge::station {

NamedColumns::NamedColumns(std::filesystem::path file, std::map<std::string, std::string> theirs)
    : file_(std::move(file)), theirs_(std::move(theirs)) {
  const std::string text = files::read_whole(file_), first = text.substr(0, text.find('\n'));
  std::istringstream names(first);
  for (std::string name; std::getline(names, name, ',');) {
    const size_t begin = name.find_first_not_of(" \r\xEF\xBB\xBF"), end = name.find_last_not_of(" \r");
    if (begin != std::string::npos) header_.push_back(name.substr(begin, end - begin + 1));
  }
}

bool NamedColumns::has(const std::string& ours) const {
  return std::count(header_.begin(), header_.end(), theirs(ours)) > 0;
}

std::vector<double> NamedColumns::operator()(const std::string& ours, bool may_be_empty) const {
  return files::read_csv(file_, {{theirs(ours), may_be_empty}}).values;
}

std::vector<int> NamedColumns::whole_numbers(const std::string& ours) const {
  const files::CsvTable table = files::read_csv(file_, {{theirs(ours)}});
  std::vector<int> out;
  for (size_t row = 0; row < table.rows(); ++row)
    out.push_back(files::whole_number(table, row, 0, theirs(ours).c_str()));
  return out;
}

std::vector<double> NamedColumns::first_of(const std::vector<std::pair<std::string, double>>& ours) const {
  for (const auto& [name, factor] : ours) {
    if (!has(name)) continue;
    std::vector<double> values = (*this)(name);
    for (double& v : values) v *= factor;
    return values;
  }
  std::string names;
  for (const auto& [name, factor] : ours) names += (names.empty() ? "" : ", ") + name;
  refuse(file_.string(),
         "found none of the columns {}, expected one of them (--columns OURS=THEIRS says what another is called)",
         names);
}

std::string NamedColumns::theirs(const std::string& ours) const {
  const auto at = theirs_.find(ours);
  return at == theirs_.end() ? ours : at->second;
}

}  // namespace selvedge::station
