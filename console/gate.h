// Which requests are let in. A page of another site may send requests to the console from the same browser, by its
// address or under a name of its own that it lets point here; so the Host must be one that the console was told of, and
// whatever changes anything must carry the token, which only those who read the console's start have.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace selvedge::console {

struct Asked {
  std::string method, path, host, origin, token;
};

class Gate {
 public:
  // hosts: "127.0.0.1:8080" and so on, as browsers send them.
  Gate(std::vector<std::string> hosts, std::string token) : hosts_(std::move(hosts)), token_(std::move(token)) {}

  // Why a request is refused; none where it is let in. Every method but GET and HEAD changes something.
  std::optional<std::string> refusal(const Asked& request) const;

 private:
  std::vector<std::string> hosts_;
  std::string token_;
};

// 32 random bytes in hexadecimal, from the kernel.
std::string random_token();

// A file below `root` by its relative path; none where the path is absolute, climbs out (by .. or a link), or names no
// regular file.
std::optional<std::filesystem::path> file_below(const std::filesystem::path& root, const std::string& relative);
// Likewise a folder.
std::optional<std::filesystem::path> folder_below(const std::filesystem::path& root, const std::string& relative);

}  // namespace selvedge::console
