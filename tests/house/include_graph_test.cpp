// The house's one-way dependencies, read from the #include lines.
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/house/house_files.h"

namespace selvedge {
namespace {

namespace fs = std::filesystem;

// Rooms by path, the longest first where one lies in another.
const std::vector<std::string> rooms = {"capture/trial",
                                        "diagnose/effects",
                                        "estimate/optimisers",
                                        "model/ranks",
                                        "cli/commands",
                                        "cli/sim",
                                        "cli/verify",
                                        "geometry",
                                        "files",
                                        "report",
                                        "rig",
                                        "capture",
                                        "calib",
                                        "cloth",
                                        "render",
                                        "garment",
                                        "observe",
                                        "model",
                                        "estimate",
                                        "material_tests",
                                        "fit",
                                        "experiments",
                                        "diagnose",
                                        "evaluation",
                                        "station",
                                        "console",
                                        "library",
                                        "python",
                                        "hardware_sim",
                                        "cli",
                                        "tests",
                                        "examples"};

// What a room may include, besides itself and what those rooms may include in turn. geometry/, files/ and
// report/ are open to all (docs/decisions/0001-rooms.md).
const std::map<std::string, std::set<std::string>> may_include = {
    {"geometry", {}},
    {"files", {}},
    {"report", {}},
    {"rig", {}},
    {"capture/trial", {}},
    {"capture", {"rig", "capture/trial"}},
    {"calib", {"capture/trial"}},
    {"cloth", {}},
    {"render", {}},
    {"garment", {"cloth", "render"}},
    {"observe", {"render", "calib", "capture/trial"}},
    {"model", {"cloth", "observe", "model/ranks"}},
    {"estimate/optimisers", {}},
    {"model/ranks", {}},
    {"estimate", {"model", "estimate/optimisers"}},
    {"material_tests", {"estimate"}},
    {"fit", {"estimate", "material_tests"}},
    {"experiments", {"fit", "garment"}},
    {"station", {"rig", "capture", "calib", "fit", "capture/trial", "diagnose", "diagnose/effects"}},
    {"console", {"station", "render"}},
    {"diagnose/effects", {"model"}},
    {"diagnose", {"estimate", "fit", "diagnose/effects"}},
    {"evaluation", {"diagnose"}},
    {"hardware_sim", {"rig", "render", "calib", "capture/trial"}},
    {"library", {}},
    {"python", {"library", "diagnose"}},
    // Three programs: what a lab runs knows no simulated world.
    {"cli", {"station"}},
    {"cli/commands", {"cli", "console", "experiments"}},
    {"cli/sim", {"cli", "hardware_sim"}},
    {"cli/verify", {"cli", "console", "evaluation", "experiments", "hardware_sim"}},
};
const std::set<std::string> open_to_all = {"geometry", "files", "report"};
// geometry/ and files/ themselves rest on nothing; report/ writes files.
const std::map<std::string, std::set<std::string>> of_the_open_ones = {
    {"geometry", {}}, {"files", {}}, {"report", {"files"}}};

std::string room_of(const std::string& path) {
  for (const std::string& room : rooms)
    if (path.rfind(room + "/", 0) == 0) return room;
  return path.rfind("selvedge_rig/", 0) == 0 ? "rig" : "";  // generated messages
}

std::set<std::string> reachable(const std::string& room) {
  if (of_the_open_ones.count(room)) {
    std::set<std::string> all = of_the_open_ones.at(room);
    all.insert(room);
    return all;
  }
  std::set<std::string> all = open_to_all;
  all.insert(room);
  for (const std::string& next : may_include.at(room)) all.merge(reachable(next));
  return all;
}

TEST(IncludeGraph, DependenciesGoOneWay) {
  size_t edges = 0;
  for (const house::Include& include : house::includes()) {
    const std::string from = room_of(include.file), to = room_of(include.target);
    if (to.empty() || from == "tests" || from == "examples") continue;
    ++edges;
    EXPECT_TRUE(reachable(from).count(to))
        << include.file << " includes \"" << include.target << "\", but " << from << "/ may not include " << to << "/";
  }
  EXPECT_GT(edges, 50u);
}

TEST(IncludeGraph, HiddenEffectsAreKnownToTheSimulatedWorldAlone) {
  for (const house::Include& include : house::includes()) {
    if (include.target.rfind("hardware_sim/hidden_effects/", 0) != 0) continue;
    const std::string from = room_of(include.file);
    EXPECT_TRUE(from == "hardware_sim" || from == "tests") << include.file << " includes " << include.target;
  }
}

TEST(IncludeGraph, IncludesAreRootedAtTheTop) {
  for (const house::Include& include : house::includes()) {
    EXPECT_EQ(include.target.find("../"), std::string::npos) << include.file << " includes " << include.target;
    if (!room_of(include.target).empty() && include.target.rfind("selvedge_rig/", 0) != 0) {
      EXPECT_TRUE(fs::exists(fs::path(SELVEDGE_SOURCE_DIR) / include.target))
          << include.file << " includes " << include.target << ", which is not there";
    }
  }
}

TEST(House, HasNoUtil) { EXPECT_FALSE(fs::exists(fs::path(SELVEDGE_SOURCE_DIR) / "util")); }

}  // namespace
}  // namespace selvedge
