// Bytes as text, for pictures within HTML and events. RFC 4648, section 4.
#pragma once

#include <string>

namespace selvedge::report {

std::string base64(const std::string& bytes);

}  // namespace selvedge::report
