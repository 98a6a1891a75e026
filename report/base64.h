// Bytes as text, for pictures within HTML and events. RFC 4648, section 4.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace selvedge::report {

std::string base64(const std::string& bytes);

// The bytes again; none where the text is no base64.
std::optional<std::string> from_base64(std::string_view text);

}  // namespace selvedge::report
