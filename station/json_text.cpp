#include "station/json_text.h"

#include <nlohmann/json.hpp>

#include "report/text_table.h"

namespace selvedge::station {

std::string number_text(const nlohmann::json& value, int digits) {
  return value.is_number() ? report::short_number(value.get<double>(), digits) : "–";
}

}  // namespace selvedge::station
