// Every header compiles alone: it includes what it needs.
//
// A header whose includes reach another is compiled behind it in one go, the other first: what comes before a header is
// then nothing but what it includes anyway. So a chain of headers costs one compilation (a greedy cover of the order by
// chains). What compiled is kept by its text, so that a second run compiles what has changed.
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

// The compiler's words; empty: it compiles.
std::string compile(const std::vector<std::string>& chain) {
  std::string text;
  for (const std::string& header : chain) text += "#include \"" + header + "\"\\n";
  const Ran ran = run("printf '" + text +
                      "' | " SELVEDGE_COMPILER " @" SELVEDGE_HEADER_FLAGS " -std=c++20 -fsyntax-only -w -x c++ - 2>&1");
  return ran.status == 0 ? "" : "exit status " + std::to_string(ran.status) + "\n" + ran.output.substr(0, 2000);
}

TEST(Headers, EachCompilesAlone) {
  const Closures closures = closures_of_headers();
  EXPECT_GT(closures.size(), 200u);
  const std::map<std::string, std::string> stamps = stamps_of(closures);
  Stamps kept(SELVEDGE_HEADER_STAMPS);
  std::set<std::string> changed;
  for (const auto& [header, stamp] : stamps)
    if (!kept.knows(header, stamp)) changed.insert(header);
  const auto chains = chains_of(closures, changed);
  std::atomic<size_t> next = 0;
  std::mutex mutex;
  std::vector<std::thread> workers;
  for (unsigned i = 0; i < std::max(2u, std::thread::hardware_concurrency()); ++i)
    workers.emplace_back([&] {
      for (size_t c = next++; c < chains.size(); c = next++) {
        const std::string said = compile(chains[c]);
        const std::lock_guard lock(mutex);
        if (said.empty())
          for (const std::string& header : chains[c]) kept.keep(header, stamps.at(header));
        else ADD_FAILURE() << "does not compile alone: " << chains[c].back() << " or one that it reaches: " << said;
      }
    });
  for (std::thread& worker : workers) worker.join();
  std::printf("%zu of %zu headers compiled in %zu chains\n", changed.size(), closures.size(), chains.size());
}

TEST(Headers, AChainHoldsWhatItsLastHeaderReaches) {
  const Closures closures = {{"a", {}}, {"b", {"a"}}, {"c", {"a", "b"}}, {"d", {"a"}}};
  EXPECT_EQ(chains_of(closures, {"a", "b", "c", "d"}), (std::vector<std::vector<std::string>>{{"a", "b", "c"}, {"d"}}));
}

}  // namespace
}  // namespace selvedge::house
