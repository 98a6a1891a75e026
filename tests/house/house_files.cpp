#include "tests/house/house_files.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>

#include <sys/wait.h>

namespace selvedge::house {

namespace {

namespace fs = std::filesystem;

std::vector<std::string> found_files() {
  std::vector<std::string> found;
  std::istringstream listed(run("git ls-files --cached --others --exclude-standard 2> /dev/null").output);
  for (std::string line; std::getline(listed, line);)
    if (fs::is_regular_file(fs::path(SELVEDGE_SOURCE_DIR) / line)) found.push_back(line);
  if (found.empty())
    for (fs::recursive_directory_iterator entry(SELVEDGE_SOURCE_DIR), end; entry != end; ++entry) {
      const std::string name = entry->path().filename().string();
      if (entry->is_directory() && (name.starts_with("build") || name.starts_with(".")))
        entry.disable_recursion_pending();
      else if (entry->is_regular_file()) found.push_back(fs::relative(entry->path(), SELVEDGE_SOURCE_DIR).string());
    }
  std::sort(found.begin(), found.end());
  return found;
}

// Tarjan's depth-first walk: a vertex whose lowest reachable one on the stack is itself ends a component.
class Components {
 public:
  explicit Components(const std::map<std::string, std::vector<std::string>>& edges) : edges_(edges) {
    for (const auto& [vertex, targets] : edges)
      if (!index_.count(vertex)) visit(vertex);
  }
  std::vector<std::vector<std::string>> found;

 private:
  void visit(const std::string& vertex) {
    index_[vertex] = lowest_[vertex] = index_.size();
    stack_.push_back(vertex);
    open_.insert(vertex);
    if (const auto targets = edges_.find(vertex); targets != edges_.end())
      for (const std::string& next : targets->second) {
        if (!index_.count(next)) {
          visit(next);
          lowest_[vertex] = std::min(lowest_[vertex], lowest_[next]);
        } else if (open_.count(next)) lowest_[vertex] = std::min(lowest_[vertex], index_[next]);
      }
    if (lowest_[vertex] != index_[vertex]) return;
    std::vector<std::string> part;
    do {
      part.push_back(stack_.back());
      open_.erase(stack_.back());
      stack_.pop_back();
    } while (part.back() != vertex);
    std::sort(part.begin(), part.end());
    if (part.size() > 1) found.push_back(part);
  }

  const std::map<std::string, std::vector<std::string>>& edges_;
  std::map<std::string, size_t> index_, lowest_;
  std::vector<std::string> stack_;
  std::set<std::string> open_;
};

}  // namespace

const std::vector<std::string>& files() {
  static const std::vector<std::string> list = found_files();
  return list;
}

std::vector<std::string> files_ending(const std::vector<std::string>& endings) {
  std::vector<std::string> found;
  std::copy_if(files().begin(), files().end(), std::back_inserter(found), [&](const std::string& file) {
    return std::any_of(endings.begin(), endings.end(), [&](const std::string& end) { return file.ends_with(end); });
  });
  return found;
}

std::vector<std::string> lines_of(const std::string& file) {
  std::ifstream stream(fs::path(SELVEDGE_SOURCE_DIR) / file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<Include> includes() {
  std::vector<Include> found;
  for (const std::string& file : files_ending({".h", ".hpp", ".cpp"}))
    for (const std::string& line : lines_of(file)) {
      if (!line.starts_with("#include")) continue;
      const size_t start = line.find_first_of("\"<"), end = line.find_first_of("\">", start + 1);
      if (start != std::string::npos && end != std::string::npos)
        found.push_back({file, line.substr(start + 1, end - start - 1)});
    }
  return found;
}

std::map<std::string, std::vector<std::string>> includes_of_the_house() {
  std::map<std::string, std::vector<std::string>> edges;
  const std::set<std::string> all(files().begin(), files().end());
  for (const std::string& file : files_ending({".h", ".hpp", ".cpp"})) edges[file];
  for (const Include& include : includes())
    if (all.count(include.target)) edges[include.file].push_back(include.target);
  return edges;
}

Ran run(const std::string& command) {
  Ran ran;
  FILE* pipe = ::popen(("cd '" SELVEDGE_SOURCE_DIR "' && " + command).c_str(), "r");
  if (!pipe) return ran;
  for (char part[4096]; size_t n = std::fread(part, 1, sizeof part, pipe);) ran.output.append(part, n);
  const int status = ::pclose(pipe);
  ran.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ran;
}

std::vector<std::vector<std::string>> circles(const std::map<std::string, std::vector<std::string>>& edges) {
  return Components(edges).found;
}

}  // namespace selvedge::house
