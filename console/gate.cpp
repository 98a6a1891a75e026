#include "console/gate.h"

#include <algorithm>
#include <random>

#include <fmt/format.h>

namespace selvedge::console {

namespace {

namespace fs = std::filesystem;

// In a time that does not tell how much of it was right.
bool same(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (size_t i = 0; i < a.size(); ++i) difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

std::optional<fs::path> below(const fs::path& root, const std::string& relative) {
  if (relative.empty() || relative.find('\0') != std::string::npos || relative.find('\\') != std::string::npos)
    return std::nullopt;
  const fs::path path(relative);
  if (path.is_absolute()) return std::nullopt;
  for (const fs::path& part : path)
    if (part == "..") return std::nullopt;
  std::error_code error;
  const fs::path whole = fs::canonical(root / path, error), top = fs::canonical(root, error);
  if (error) return std::nullopt;
  const auto [end, ignored] = std::mismatch(top.begin(), top.end(), whole.begin(), whole.end());
  if (end != top.end()) return std::nullopt;
  return whole;
}

}  // namespace

std::optional<std::string> Gate::refusal(const Asked& request) const {
  if (std::find(hosts_.begin(), hosts_.end(), request.host) == hosts_.end())
    return fmt::format("host {:.60} is not this console", request.host);
  if (!request.origin.empty() && std::none_of(hosts_.begin(), hosts_.end(), [&](const std::string& host) {
        return request.origin == "http://" + host;
      }))
    return fmt::format("origin {:.60} is not this console", request.origin);
  if (request.method == "GET" || request.method == "HEAD") return std::nullopt;
  if (!same(request.token, token_)) return "no token, or not this console's";
  return std::nullopt;
}

std::string random_token() {
  std::random_device device;  // the kernel's on Linux
  std::string token;
  for (int i = 0; i < 8; ++i) token += fmt::format("{:08x}", static_cast<unsigned>(device()));
  return token;
}

std::optional<fs::path> file_below(const fs::path& root, const std::string& relative) {
  const auto path = below(root, relative);
  return path && fs::is_regular_file(*path) ? path : std::nullopt;
}

std::optional<fs::path> folder_below(const fs::path& root, const std::string& relative) {
  const auto path = below(root, relative);
  return path && fs::is_directory(*path) ? path : std::nullopt;
}

}  // namespace selvedge::console
