// A number of a summary as the session's and the comparison's pages say it.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace selvedge::station {

// Rounded to so many digits; a dash where there is none.
std::string number_text(const nlohmann::json& value, int digits = 3);

}  // namespace selvedge::station
