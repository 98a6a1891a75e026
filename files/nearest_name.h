// What somebody may have meant by a name that is not known: a command, an option, a key.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace selvedge::files {

// The name that the fewest changes lead to: letters added, left out, taken for another, or two neighbours changed over
// (Damerau 1964). At most one change in three letters, or none of the names was meant: empty then. Upper and lower
// case, and - and _, are the same.
std::string nearest_name(std::string_view written, const std::vector<std::string>& names);

// ", did you mean NAME?", or nothing.
std::string did_you_mean(std::string_view written, const std::vector<std::string>& names);

}  // namespace selvedge::files
