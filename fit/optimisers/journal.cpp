#include "fit/optimisers/journal.h"

#include <charconv>
#include <cmath>

#include "files/bad_input.h"
#include "files/csv_table.h"
#include "files/whole_file.h"

namespace selvedge::fit {

namespace {

std::string text_of(const Eigen::VectorXd& point) {
  std::string text;
  for (const double x : point) {
    files::append_number(text, x);
    text += ',';
  }
  return text;
}

}  // namespace

Journal::Journal(const std::filesystem::path& path, const std::string& identity) {
  const std::string first = "selvedge-journal/1 " + identity + "\n";
  // Without a whole first line it was begun and no more: nothing is in it.
  if (!std::filesystem::exists(path) || files::read_whole(path).find('\n') == std::string::npos) {
    std::filesystem::remove(path);
    if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path());
    file_ = std::make_unique<files::AppendFile>(path, first);
    return;
  }
  const std::string text = files::read_whole(path);
  if (text.compare(0, first.size(), first) != 0)
    refuse(path.string(), "found the journal of another search, {}, expected that of this one, {}; choose another folder or remove it",
           in_quotes(text.substr(0, text.find('\n'))), in_quotes(first.substr(0, first.size() - 1)));
  size_t line = 1;
  for (size_t at = first.size(); at < text.size(); ++line) {
    const size_t end = text.find('\n', at);
    if (end == std::string::npos) break;  // torn by the kill; the file is cut there
    const size_t comma = text.rfind(',', end);
    double cost = 0;
    const char* last = text.data() + end;
    if (comma == std::string::npos || comma < at || std::from_chars(text.data() + comma + 1, last, cost).ptr != last)
      refuse(path.string() + ":" + std::to_string(line + 1), "found {}, expected coordinates and a cost", in_quotes(text.substr(at, end - at)));
    cost_of_[text.substr(at, comma + 1 - at)] = cost;
    at = end + 1;
  }
  found_ = cost_of_.size();
  file_ = std::make_unique<files::AppendFile>(path);
}

BatchCosts Journal::recorded(BatchCosts costs) {
  return [this, costs = std::move(costs)](const Eigen::MatrixXd& points) { return costs_of(points, costs); };
}

std::vector<double> Journal::costs_of(const Eigen::MatrixXd& points, const BatchCosts& costs) {
  std::vector<std::string> texts;
  std::vector<Eigen::Index> unknown;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    texts.push_back(text_of(points.col(i)));
    if (!cost_of_.count(texts.back())) unknown.push_back(i);
  }
  if (!unknown.empty()) {
    const std::vector<double> fresh = costs(points(Eigen::all, unknown));
    std::string lines;
    for (size_t k = 0; k < unknown.size(); ++k) {
      const double cost = std::isnan(fresh[k]) ? std::numeric_limits<double>::infinity() : fresh[k];
      const std::string& text = texts[static_cast<size_t>(unknown[k])];
      cost_of_[text] = cost;
      lines += text;
      files::append_number(lines, cost);
      lines += '\n';
    }
    file_->append(lines);
  }
  std::vector<double> all;
  for (const std::string& text : texts) all.push_back(cost_of_.at(text));
  return all;
}

}  // namespace selvedge::fit
