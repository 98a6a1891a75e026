// Documents: where their links lead, and that the catalogue of effects is whole.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "diagnose/effects/library.h"

namespace selvedge::docs {
namespace {

namespace fs = std::filesystem;

const fs::path kSource = SELVEDGE_SOURCE_DIR;

std::string text_of(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<fs::path> documents() {
  std::vector<fs::path> found = {kSource / "README.md", kSource / "CONTRIBUTING.md", kSource / "CHANGELOG.md"};
  for (const auto& entry : fs::recursive_directory_iterator(kSource / "docs"))
    if (entry.path().extension() == ".md") found.push_back(entry.path());
  return found;
}

// Without fenced and indented blocks, in which brackets are code.
std::string prose_of(const fs::path& file) {
  std::ifstream stream(file);
  std::string prose;
  bool fenced = false;
  for (std::string line; std::getline(stream, line);) {
    if (line.find("```") != std::string::npos) fenced = !fenced;
    else if (!fenced && !line.starts_with("    ")) prose += line + "\n";
  }
  return prose;
}

// As the pages of GitHub and mkdocs name a heading: lower case, words joined by -.
std::set<std::string> anchors_of(const fs::path& file) {
  std::set<std::string> found;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with("#")) continue;
    std::string anchor;
    for (const char c : line.substr(line.find_first_not_of("# "))) {
      if (std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-')
        anchor += static_cast<char>(std::tolower(c));
      else if (c == ' ') anchor += '-';
    }
    found.insert(anchor);
  }
  return found;
}

TEST(Documents, RelativeLinksLeadSomewhere) {
  static const std::regex link(R"(\]\(([^)\s]+)\))");
  size_t links = 0;
  for (const fs::path& file : documents()) {
    const std::string prose = prose_of(file);
    for (std::sregex_iterator at(prose.begin(), prose.end(), link), end; at != end; ++at) {
      const std::string target = (*at)[1];
      if (target.starts_with("http")) continue;
      ++links;
      const size_t hash = target.find('#');
      const fs::path path = hash == 0 ? file : file.parent_path() / target.substr(0, hash);
      EXPECT_TRUE(fs::exists(path)) << file << ": " << target << " leads nowhere";
      if (hash != std::string::npos && path.extension() == ".md" && fs::exists(path)) {
        EXPECT_TRUE(anchors_of(path).count(target.substr(hash + 1))) << file << ": no heading for " << target;
      }
    }
  }
  EXPECT_GT(links, 100u);
}

TEST(Documents, EveryEffectHasAnEntryWithAPicture) {
  constexpr std::uintmax_t kLargestPicture = 30000;
  const std::string catalogue = text_of(kSource / "docs" / "effects.md");
  for (const diagnose::Effect& effect : diagnose::effect_library()) {
    const size_t at = catalogue.find("\n### " + effect.name + "\n");
    ASSERT_NE(at, std::string::npos) << "docs/effects.md has no entry for " << effect.name;
    const std::string entry = catalogue.substr(at, catalogue.find("\n#", at + 5) - at);
    EXPECT_NE(entry.find("\nConfused with: "), std::string::npos) << effect.name;
    EXPECT_NE(entry.find("](pictures/effects/" + effect.name + ".svg)"), std::string::npos) << effect.name;
    const fs::path picture = kSource / "docs" / "pictures" / "effects" / (effect.name + ".svg");
    ASSERT_TRUE(fs::exists(picture)) << picture << ": docs/pictures/draw_effects.py draws it";
    EXPECT_LE(fs::file_size(picture), kLargestPicture) << picture;
  }
}

TEST(Documents, NoEntryIsOfAnEffectThatIsGone) {
  std::set<std::string> known;
  for (const diagnose::Effect& effect : diagnose::effect_library()) known.insert(effect.name);
  std::ifstream stream(kSource / "docs" / "effects.md");
  for (std::string line; std::getline(stream, line);)
    if (line.starts_with("### ")) { EXPECT_TRUE(known.count(line.substr(4))) << line; }
}

}  // namespace
}  // namespace selvedge::docs
