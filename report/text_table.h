// A table as plain text: columns aligned by what they hold, for a terminal or a log.
#pragma once

#include <string>
#include <vector>

namespace selvedge::report {

// One line a row, two spaces between columns, a rule below the header. Cells that read as numbers, with or
// without a unit behind, are set to the right. UTF-8 counts by code point.
std::string text_table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);

// A number for a person: `digits` significant ones, no needless zeros or exponent; "–" where there is none.
std::string short_number(double value, int digits = 4);

}  // namespace selvedge::report
