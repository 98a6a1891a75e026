#include "estimate/optimisers/journal.h"

#include <charconv>
#include <cmath>

#include "files/bad_input.h"
#include "files/csv_table.h"

namespace selvedge::estimate {

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

Journal::Journal(const std::filesystem::path& path, const std::string& identity) : file_(path, identity) {
  for (size_t i = 0; i < file_.lines().size(); ++i) {
    const std::string& line = file_.lines()[i];
    const size_t comma = line.rfind(',');
    double cost = 0;
    const char* last = line.data() + line.size();
    const auto read = comma == std::string::npos ? std::from_chars_result{nullptr, std::errc::invalid_argument}
                                                 : std::from_chars(line.data() + comma + 1, last, cost);
    if (read.ec != std::errc() || read.ptr != last)
      refuse(file_.where(i), "found {}, expected coordinates and a cost", in_quotes(line));
    cost_of_[line.substr(0, comma + 1)] = cost;
  }
  found_ = cost_of_.size();
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
    file_.append(lines);
  }
  std::vector<double> all;
  for (const std::string& text : texts) all.push_back(cost_of_.at(text));
  return all;
}

}  // namespace selvedge::estimate
