#include "cli/verify/figures.h"

#include <algorithm>

#include <fmt/format.h>

#include "files/json_number.h"
#include "report/text_table.h"

namespace selvedge::cli {

namespace {

const char* relation_sign(Relation relation) {
  switch (relation) {
    case Relation::at_most: return "<=";
    case Relation::at_least: return ">=";
    case Relation::shown: break;
  }
  return "beside";
}

}  // namespace

bool holds(const Figure& figure) {
  switch (figure.relation) {
    case Relation::at_most: return figure.measured <= figure.reference;
    case Relation::at_least: return figure.measured >= figure.reference;
    case Relation::shown: break;
  }
  return true;
}

void print(const std::vector<Figure>& figures) {
  std::vector<std::vector<std::string>> rows;
  for (const Figure& figure : figures)
    rows.push_back({figure.what, report::short_number(figure.measured), relation_sign(figure.relation),
                    report::short_number(figure.reference), figure.unit,
                    figure.relation == Relation::shown ? ""
                    : holds(figure)                    ? "holds"
                                                       : "FALLS SHORT",
                    figure.source});
  fmt::print("{}", report::text_table({"figure", "measured", "", "reference", "unit", "", "source"}, rows));
}

nlohmann::json to_json(const std::string& name, const std::vector<Figure>& figures) {
  nlohmann::json list = nlohmann::json::array();
  bool all_hold = true;
  for (const Figure& figure : figures) {
    all_hold = all_hold && holds(figure);
    list.push_back({{"what", figure.what},
                    {"measured", files::finite_or_null(figure.measured)},
                    {"relation", relation_sign(figure.relation)},
                    {"reference", files::finite_or_null(figure.reference)},
                    {"unit", figure.unit},
                    {"source", figure.source},
                    {"holds", holds(figure)}});
  }
  return {{"name", name}, {"holds", all_hold}, {"figures", list}};
}

}  // namespace selvedge::cli
