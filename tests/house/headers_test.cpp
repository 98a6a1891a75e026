// Every header compiles alone: it includes what it needs.
//
// A header whose includes reach another is compiled behind it in one go, the other first: what comes before a header is
// then nothing but what it includes anyway. So a chain of headers costs one compilation (a greedy cover of the order by
// chains). Libraries that take a second to read are compiled once for all headers that reach just the same of them.
// What compiled is kept by its text, so that a second run compiles what has changed.
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

// Each chain in the order in which it is included.
std::vector<std::vector<std::string>> chains_of(const Closures& closures, const std::set<std::string>& wanted) {
  const auto size = [&](const std::string& header) { return closures.at(header).size(); };
  std::vector<std::string> order(wanted.begin(), wanted.end());
  std::stable_sort(order.begin(), order.end(),
                   [&](const std::string& a, const std::string& b) { return size(a) > size(b); });
  std::set<std::string> left = wanted;
  std::vector<std::vector<std::string>> chains;
  for (const std::string& top : order) {
    if (!left.erase(top)) continue;
    std::vector<std::string> chain = {top};
    for (;;) {
      std::string next;
      for (const std::string& header : closures.at(chain.back()))
        if (left.count(header) && (next.empty() || size(header) > size(next))) next = header;
      if (next.empty()) break;
      left.erase(next);
      chain.push_back(next);
    }
    std::reverse(chain.begin(), chain.end());
    chains.push_back(chain);
  }
  return chains;
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
std::vector<std::string> slow_of(const Closures& closures, const std::string& header) {
  std::string text = text_of(header);
  for (const std::string& file : closures.at(header)) text += text_of(file);
  std::vector<std::string> out;
  for (const char* slow : {"Eigen/Core", "Eigen/Geometry", "filesystem", "functional", "gtest/gtest.h",
                           "nlohmann/json.hpp", "opencv2/core.hpp"})
    if (text.find("#include <" + std::string(slow) + ">") != std::string::npos) out.emplace_back(slow);
  return out;
}

// The compiler's words; empty: it compiles. what: options and the file, as a shell takes them.
std::string compile(const std::string& what) {
  const Ran ran = run(SELVEDGE_COMPILER " @" SELVEDGE_HEADER_FLAGS " -std=c++20 -w " + what + " 2>&1");
  return ran.status == 0 ? "" : "exit status " + std::to_string(ran.status) + "\n" + ran.output.substr(0, 2000);
}

// Headers that reach the same slow libraries.
struct Alike {
  std::string precompiled;  // the file to include for those libraries; empty: none
  std::vector<std::vector<std::string>> chains;
};

Alike precompile(const std::vector<std::string>& slow, const std::string& file) {
  if (slow.empty()) return {};
  std::ofstream text(file);
  for (const std::string& name : slow) text << "#include <" << name << ">\n";
  text.close();
  EXPECT_EQ(compile("-x c++-header -o '" + file + ".gch' '" + file + "'"), "");
  return {file, {}};
}

std::string compile_chain(const Alike& alike, const std::vector<std::string>& chain, const std::string& file) {
  std::ofstream text(file);
  for (const std::string& header : chain) text << "#include \"" << header << "\"\n";
  text.close();
  const std::string first = alike.precompiled.empty() ? "" : " -Winvalid-pch -include '" + alike.precompiled + "'";
  return compile("-fsyntax-only" + first + " '" + file + "'");
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
  std::map<std::vector<std::string>, std::set<std::string>> by_slow;
  for (const std::string& header : changed) by_slow[slow_of(closures, header)].insert(header);
  const std::vector<std::pair<std::vector<std::string>, std::set<std::string>>> groups(by_slow.begin(), by_slow.end());
  const fs::path folder = fs::temp_directory_path() / ("selvedge_headers_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::vector<Alike> alike(groups.size());
  on_all_processors(groups.size(), [&](size_t i) {
    alike[i] = precompile(groups[i].first, folder / (std::to_string(i) + ".h"));
    alike[i].chains = chains_of(closures, groups[i].second);
  });
  std::vector<std::pair<size_t, size_t>> chains;
  for (size_t i = 0; i < alike.size(); ++i)
    for (size_t k = 0; k < alike[i].chains.size(); ++k) chains.emplace_back(i, k);
  std::mutex mutex;
  on_all_processors(chains.size(), [&](size_t i) {
    const Alike& those = alike[chains[i].first];
    const std::vector<std::string>& chain = those.chains[chains[i].second];
    const std::string said = compile_chain(those, chain, folder / (std::to_string(i) + ".cpp"));
    const std::lock_guard lock(mutex);
    if (said.empty())
      for (const std::string& header : chain) kept.keep(header, stamps.at(header));
    else ADD_FAILURE() << "does not compile alone: " << chain.back() << " or one that it reaches: " << said;
  });
  fs::remove_all(folder);
  std::printf("%zu of %zu headers compiled in %zu chains\n", changed.size(), closures.size(), chains.size());
}

TEST(Headers, AChainHoldsWhatItsLastHeaderReaches) {
  const Closures closures = {{"a", {}}, {"b", {"a"}}, {"c", {"a", "b"}}, {"d", {"a"}}};
  EXPECT_EQ(chains_of(closures, {"a", "b", "c", "d"}), (std::vector<std::vector<std::string>>{{"a", "b", "c"}, {"d"}}));
}

}  // namespace
}  // namespace selvedge::house
