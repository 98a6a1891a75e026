// Every header compiles alone: it includes what it needs.
//
// By clang, whose precompiled headers cost next to nothing to read (g++'s cost a second each). Libraries that take a
// second to compile are compiled once for all headers that reach them. What compiled is kept by its text, so that a
// second run compiles what has changed.
#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/house/house_files.h"

namespace selvedge::house {
namespace {

namespace fs = std::filesystem;

using Closures = std::map<std::string, std::set<std::string>>;

// What each header reaches, itself left out.
Closures closures_of_headers() {
  const auto edges = includes_of_the_house();
  Closures closures;
  const std::function<void(const std::string&, std::set<std::string>&)> reach =
      [&](const std::string& file, std::set<std::string>& into) {
    for (const std::string& next : edges.at(file))
      if (into.insert(next).second) reach(next, into);
  };
  for (const std::string& header : files_ending({".h"})) {
    reach(header, closures[header]);
    closures[header].erase(header);
  }
  return closures;
}

std::string text_of(const std::string& file) {
  std::string text;
  for (const std::string& line : lines_of(file)) text += line + '\n';
  return text;
}

// Of a header and all that it reaches.
std::map<std::string, std::string> stamps_of(const Closures& closures) {
  std::map<std::string, size_t> hashes;
  for (const auto& [header, reached] : closures) hashes[header] = std::hash<std::string>()(text_of(header));
  std::map<std::string, std::string> stamps;
  for (const auto& [header, reached] : closures) {
    std::string all = std::to_string(hashes[header]);
    for (const std::string& file : reached) all += ' ' + std::to_string(hashes[file]);
    stamps[header] = std::to_string(std::hash<std::string>()(all));
  }
  return stamps;
}

class Stamps {
 public:
  explicit Stamps(fs::path file) : file_(std::move(file)) {
    std::ifstream stream(file_);
    for (std::string header, stamp; stream >> header >> stamp;) known_[header] = stamp;
  }
  bool knows(const std::string& header, const std::string& stamp) const {
    const auto found = known_.find(header);
    return found != known_.end() && found->second == stamp;
  }
  // At once, so that a run that is cut short is not lost.
  void keep(const std::string& header, const std::string& stamp) {
    std::ofstream(file_, std::ios::app) << header << ' ' << stamp << '\n';
  }

 private:
  fs::path file_;
  std::map<std::string, std::string> known_;
};

// Those of the slow libraries that a header reaches.
std::set<std::string> slow_of(const Closures& closures, const std::string& header) {
  std::string text = text_of(header);
  for (const std::string& file : closures.at(header)) text += text_of(file);
  std::set<std::string> out;
  for (const char* slow : {"Eigen/Core", "Eigen/Geometry", "filesystem", "functional", "gtest/gtest.h",
                           "nlohmann/json.hpp", "opencv2/core.hpp"})
    if (text.find("#include <" + std::string(slow) + ">") != std::string::npos) out.insert(slow);
  return out;
}

// Sets of slow libraries that many headers reach, and none of them.
std::vector<std::set<std::string>> worth_precompiling(const std::vector<std::set<std::string>>& slow) {
  constexpr size_t kMany = 4;
  std::map<std::set<std::string>, size_t> count = {{{}, kMany}};
  for (const std::set<std::string>& libraries : slow) ++count[libraries];
  std::vector<std::set<std::string>> sets;
  for (const auto& [libraries, headers] : count)
    if (headers >= kMany) sets.push_back(libraries);
  return sets;
}

// Nothing but what a header reaches may stand before it.
size_t largest_within(const std::vector<std::set<std::string>>& sets, const std::set<std::string>& slow) {
  size_t best = 0;
  for (size_t i = 0; i < sets.size(); ++i)
    if (sets[i].size() >= sets[best].size() && std::includes(slow.begin(), slow.end(), sets[i].begin(), sets[i].end()))
      best = i;
  return best;
}

// The compiler's words; empty: it compiles. what: options and the file, as a shell takes them.
std::string compile(const std::string& what) {
  const Ran ran = run("clang++-14 @" SELVEDGE_HEADER_FLAGS " -std=c++20 -w " + what + " 2>&1");
  return ran.status == 0 ? "" : "exit status " + std::to_string(ran.status) + "\n" + ran.output.substr(0, 2000);
}

// The file of these libraries compiled once; empty: none. Without its templates, each header would make them again.
std::string precompile(const std::set<std::string>& slow, const std::string& file) {
  if (slow.empty()) return {};
  std::ofstream text(file);
  for (const std::string& name : slow) text << "#include <" << name << ">\n";
  text.close();
  EXPECT_EQ(compile("-fpch-instantiate-templates -x c++-header -o '" + file + ".pch' '" + file + "'"), "");
  return file + ".pch";
}

std::string compile_alone(const std::string& header, const std::string& precompiled) {
  const std::string first = precompiled.empty() ? "" : " -include-pch '" + precompiled + "'";
  return compile("-fsyntax-only" + first + " -x c++ '" SELVEDGE_SOURCE_DIR "/" + header + "'");
}

// do_one(i) for each i < count, on all processors.
void on_all_processors(size_t count, const std::function<void(size_t)>& do_one) {
  std::atomic<size_t> next = 0;
  std::vector<std::thread> workers;
  for (unsigned i = 0; i < std::max(2u, std::thread::hardware_concurrency()); ++i)
    workers.emplace_back([&] {
      for (size_t k = next++; k < count; k = next++) do_one(k);
    });
  for (std::thread& worker : workers) worker.join();
}

TEST(Headers, EachCompilesAlone) {
  const Closures closures = closures_of_headers();
  EXPECT_GT(closures.size(), 200u);
  const std::map<std::string, std::string> stamps = stamps_of(closures);
  Stamps kept(SELVEDGE_HEADER_STAMPS);
  std::set<std::string> changed;
  for (const auto& [header, stamp] : stamps)
    if (!kept.knows(header, stamp)) changed.insert(header);
  const fs::path folder = fs::temp_directory_path() / ("selvedge_headers_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const std::vector<std::string> headers(changed.begin(), changed.end());
  std::vector<std::set<std::string>> slow;
  for (const std::string& header : headers) slow.push_back(slow_of(closures, header));
  const std::vector<std::set<std::string>> sets = worth_precompiling(slow);
  std::vector<std::string> precompiled(sets.size());
  on_all_processors(sets.size(),
                    [&](size_t i) { precompiled[i] = precompile(sets[i], folder / (std::to_string(i) + ".h")); });
  std::mutex mutex;
  on_all_processors(headers.size(), [&](size_t i) {
    const std::string said = compile_alone(headers[i], precompiled[largest_within(sets, slow[i])]);
    const std::lock_guard lock(mutex);
    if (said.empty()) kept.keep(headers[i], stamps.at(headers[i]));
    else ADD_FAILURE() << headers[i] << " does not compile alone: " << said;
  });
  fs::remove_all(folder);
  std::printf("%zu of %zu headers compiled, with %zu sets of slow libraries\n", headers.size(), closures.size(),
              sets.size());
}

}  // namespace
}  // namespace selvedge::house
