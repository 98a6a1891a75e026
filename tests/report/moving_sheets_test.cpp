// The moving figure as a browser draws it, and what it refuses.
#include "report/moving_sheets.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "files/whole_file.h"
#include "report/html.h"
#include "tests/needs_package.h"

namespace selvedge::report {
namespace {

// A flat sheet that falls, of two models, with one recorded point that the second has right.
MovingSheet falling() {
  MovingSheet s;
  s.name = "waving-<1>";
  s.across = 2;
  s.time_s = {0, 0.5F};
  s.seen = {{0, 0, 0}, {0, 0, -0.1F}};
  const std::vector<Points> sheet = {{0, 0, 0, 0.3F, 0, 0, 0, 0, -0.3F, 0.3F, 0, -0.3F},
                                     {0, 0, -0.1F, 0.3F, 0, -0.1F, 0, 0, -0.4F, 0.3F, 0, -0.4F}};
  s.views = {{"the base model", sheet, {{0, 0, 0.002F}, {0, 0, -0.098F}}}, {"with draught", sheet, s.seen}};
  s.arrow_uv = {0.5F, 0.5F};
  s.arrows = {{0, 0.25F, {0, 0.4F, 0}, {0.1F, 0.1F, 0.1F}}};
  return s;
}

TEST(MovingSheets, AreDrawnByABrowserThatIsOffline) {
  SELVEDGE_NEEDS(std::system("command -v chromium > /dev/null") == 0, "chromium", "the figure in a browser");
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("selvedge_moving_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  HtmlReport html("A figure that moves");
  html.interactive(moving_sheets({falling()}, "missing force", "N/m²"), "caption");
  html.write(folder / "report.html");
  const std::string command =
      "timeout 60 chromium --headless --no-sandbox --disable-gpu --user-data-dir=" + (folder / "profile").string() +
      " --virtual-time-budget=2000 --dump-dom file://" + (folder / "report.html").string() + " > " +
      (folder / "dom.html").string() + " 2> /dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string dom = files::read_whole(folder / "dom.html");
  EXPECT_NE(dom.find("data-drawn=\"0\""), std::string::npos);
  EXPECT_NE(dom.find("<div>the base model: 2.00 mm off</div>"), std::string::npos) << dom;
  EXPECT_NE(dom.find("<div>with draught: 0.00 mm off; longest arrow 0.40 N/m²</div>"), std::string::npos);
  EXPECT_NE(dom.find(">waving-&lt;1&gt;</option>"), std::string::npos);
  EXPECT_NE(dom.find("arrow keys turn them"), std::string::npos);  // by keyboard too
  EXPECT_EQ(dom.find("https://"), std::string::npos);
  std::filesystem::remove_all(folder);
}

TEST(MovingSheets, RefuseListsThatDoNotHaveOneEntryATime) {
  MovingSheet s = falling();
  s.views[0].expected.pop_back();
  EXPECT_THROW(moving_sheets({s}, "missing force", "N/m²"), std::invalid_argument);
  s = falling();
  s.seen.pop_back();
  EXPECT_THROW(moving_sheets({s}, "missing force", "N/m²"), std::invalid_argument);
}

TEST(MovingSheets, HoldNothingThatEndsTheirScript) {
  MovingSheet s = falling();
  s.name = "</script><b>";
  EXPECT_EQ(moving_sheets({s}, "missing force", "N/m²").find("</script><b>"), std::string::npos);
}

}  // namespace
}  // namespace selvedge::report
