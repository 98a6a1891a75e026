// The worked examples on packages that a plain build does not need: found good by ./selvedge simulator check, and
// skipped loudly where their package is absent.
#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <unistd.h>

#include "cli/verify/proofs/worked_examples.h"
#include "files/whole_file.h"
#include "tests/cli/run_binary.h"

namespace selvedge::cli {
namespace {

class WorkedExamples : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) / ("selvedge_worked_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  Ran check(const std::string& command) const {
    return run_binary("simulator check \"" + command + "\" --run-limit 300", folder_);
  }
  void expect_found_good(const WorkedExample& example) const {
    if (!example.absent.empty())
      GTEST_SKIP() << "SKIPPED: Debian's package " << example.absent << " is not installed, its example was NOT tried";
    const Ran ran = check(example.command);
    EXPECT_EQ(ran.exit_status, 0) << ran.out << ran.err;
    for (const char* good : {"the same wave by a second process: 0 mm apart", "it ends when its standard input is"})
      EXPECT_NE(ran.out.find("ok      " + std::string(good)), std::string::npos) << ran.out;
  }
  std::filesystem::path folder_;
};

TEST_F(WorkedExamples, BlendersClothIsFoundGood) { expect_found_good(blender_cloth_example(16)); }

TEST_F(WorkedExamples, BulletsSoftBodyIsFoundGood) { expect_found_good(bullet_example(folder_)); }

// Before Blender starts, and where there is none too.
TEST_F(WorkedExamples, BlendersOptionsAreRefusedByName) {
  const Ran ran = check("python3 '" SELVEDGE_SOURCE_DIR "/examples/simulators/blender_cloth.py' --quads 8");
  EXPECT_EQ(ran.exit_status, 2);
  EXPECT_NE(ran.out.find("unrecognized arguments: --quads 8"), std::string::npos) << ran.out;
}

// As docs/simulator.md says of those to begin from.
TEST(SimulatorExamples, ToBeginFromAreAsShortAsTheirPageSays) {
  const std::string page = files::read_whole(SELVEDGE_SOURCE_DIR "/docs/simulator.md");
  for (const auto& [name, most] : {std::pair{"mass_spring.py", 40}, {"mass_spring.cpp", 71}}) {
    const std::string text = files::read_whole(SELVEDGE_SOURCE_DIR "/examples/simulators/" + std::string(name));
    EXPECT_LE(std::count(text.begin(), text.end(), '\n'), most) << name;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120u) << name << ": " << line;
    EXPECT_NE(page.find(std::to_string(most)), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace selvedge::cli
