#include "files/nearest_name.h"

#include <algorithm>
#include <cctype>

namespace selvedge::files {

namespace {

std::string plain(std::string_view text) {
  std::string out;
  for (const char c : text) out += c == '_' ? '-' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

size_t changes_between(const std::string& a, const std::string& b) {
  std::vector<std::vector<size_t>> least(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i)
    for (size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        least[i][j] = i + j;
        continue;
      }
      const size_t another = least[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      least[i][j] = std::min({least[i - 1][j] + 1, least[i][j - 1] + 1, another});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        least[i][j] = std::min(least[i][j], least[i - 2][j - 2] + 1);
    }
  return least[a.size()][b.size()];
}

}  // namespace

std::string nearest_name(std::string_view written, const std::vector<std::string>& names) {
  const std::string asked = plain(written);
  std::string nearest;
  size_t least = std::max<size_t>(1, asked.size() / 3) + 1;
  for (const std::string& name : names)
    if (const size_t changes = changes_between(asked, plain(name)); changes < least && changes < name.size()) {
      least = changes;
      nearest = name;
    }
  return nearest;
}

std::string did_you_mean(std::string_view written, const std::vector<std::string>& names) {
  const std::string nearest = nearest_name(written, names);
  return nearest.empty() ? "" : ", did you mean " + nearest + "?";
}

}  // namespace selvedge::files
